"""Recordings and folders of pictures: `riseg segment`."""
