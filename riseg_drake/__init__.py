"""Interactive segmentation of unknown objects by a nudging robot (rt-RISeg), in Drake."""
