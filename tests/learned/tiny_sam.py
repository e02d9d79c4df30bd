"""Segment Anything in small: the real classes of transformers with random weights, milliseconds an image."""

from typing import Any

SIDE, PATCH = 128, 16


def tiny_sam() -> Any:
    """A SamModel for squares of 128 pixels."""
    import torch
    from transformers import (
        SamConfig,
        SamMaskDecoderConfig,
        SamModel,
        SamPromptEncoderConfig,
        SamVisionConfig,
    )

    torch.manual_seed(0)
    vision = SamVisionConfig(
        hidden_size=32,
        num_hidden_layers=2,
        num_attention_heads=2,
        output_channels=32,
        image_size=SIDE,
        patch_size=PATCH,
        window_size=4,
        global_attn_indexes=[1],
        num_pos_feats=16,
        mlp_dim=64,
        initializer_range=0.02,
    )
    prompting = SamPromptEncoderConfig(hidden_size=32, image_size=SIDE, patch_size=PATCH, mask_input_channels=8)
    decoder = SamMaskDecoderConfig(hidden_size=32, mlp_dim=64, num_attention_heads=2, iou_head_hidden_dim=32)
    return SamModel(
        SamConfig(vision_config=vision, prompt_encoder_config=prompting, mask_decoder_config=decoder)
    )


def tiny_sam2() -> Any:
    """A Sam2Model for squares of 128 pixels."""
    import torch
    from transformers import (
        Sam2Config,
        Sam2HieraDetConfig,
        Sam2MaskDecoderConfig,
        Sam2Model,
        Sam2PromptEncoderConfig,
        Sam2VisionConfig,
    )

    torch.manual_seed(0)
    backbone = Sam2HieraDetConfig(
        hidden_size=16,
        image_size=[SIDE, SIDE],
        blocks_per_stage=[1, 1, 2, 1],
        embed_dim_per_stage=[16, 32, 64, 128],
        num_attention_heads_per_stage=[1, 1, 2, 2],
        window_size_per_stage=[8, 4, 4, 4],
        global_attention_blocks=[3],
    )
    vision = Sam2VisionConfig(
        backbone_config=backbone,
        backbone_channel_list=[128, 64, 32, 16],
        backbone_feature_sizes=[[32, 32], [16, 16], [8, 8]],
        fpn_hidden_size=32,
    )
    prompting = Sam2PromptEncoderConfig(
        hidden_size=32, image_size=SIDE, patch_size=PATCH, mask_input_channels=8
    )
    decoder = Sam2MaskDecoderConfig(hidden_size=32, mlp_dim=64, num_attention_heads=2, iou_head_hidden_dim=32)
    model = Sam2Model(
        Sam2Config(vision_config=vision, prompt_encoder_config=prompting, mask_decoder_config=decoder)
    )
    # Public weights have one code of places for prompts and patches; drawn at random there would be two.
    for_patches, for_prompts = model.shared_image_embedding, model.prompt_encoder.shared_embedding
    for_prompts.load_state_dict(for_patches.state_dict())
    return model
