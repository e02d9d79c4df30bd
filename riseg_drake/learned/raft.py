"""RAFT (Teed and Deng, *RAFT: Recurrent All-Pairs Field Transforms for Optical Flow*, ECCV 2020).

Features of both images at an eighth of the size are compared all with all; a recurrent unit looks up, again
and again, how well the pixels around the present guess agree, and corrects it. Imports torch: whoever only
might need it imports `raft_flow` instead.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

PYRAMID_LEVELS = 4
STRIDE = 8
"""Pixels of the image for one of the feature maps."""
Norm = Callable[[int], nn.Module]
"""Makes the normalisation of so many channels."""


@dataclass(frozen=True)
class RaftSize:
    """The widths (channels) in which the paper's two networks differ."""

    stem: int
    stages: tuple[int, int, int]
    features: int
    hidden: int
    context: int
    lookup_radius: int
    correlation: tuple[int, ...]
    flow: tuple[int, int]
    motion: int
    flow_head: int
    is_large: bool


RAFT_SMALL = RaftSize(32, (32, 64, 96), 128, 96, 64, 3, (96,), (64, 32), 82, 128, False)
"""One million parameters."""
RAFT_LARGE = RaftSize(64, (64, 96, 128), 256, 128, 128, 4, (256, 192), (128, 64), 128, 256, True)
"""5.3 million parameters."""


class Raft(nn.Module):
    """The network. What belongs to which checkpoint is said in `raft_checkpoint`."""

    def __init__(self, size: RaftSize = RAFT_SMALL) -> None:
        super().__init__()
        self.size = size
        context_norm = nn.BatchNorm2d if size.is_large else nn.Identity
        self.features = _Encoder(size, size.features, nn.InstanceNorm2d)
        self.context = _Encoder(size, size.hidden + size.context, context_norm)
        self.motion = _MotionEncoder(size)
        kernels = ((1, 5), (5, 1)) if size.is_large else ((3, 3),)
        self.gru = nn.ModuleList(_ConvGru(size.hidden, size.motion + size.context, k) for k in kernels)
        self.flow_head = _FlowHead(size)
        self.upsampling = (
            nn.Sequential(
                nn.Conv2d(size.hidden, 256, 3, padding=1), nn.ReLU(), nn.Conv2d(256, 9 * STRIDE**2, 1)
            )
            if size.is_large
            else None
        )

    def forward(self, image_0: Tensor, image_1: Tensor, iterations: int = 12) -> list[Tensor]:
        """Flow [N, 2, H, W] in pixels from image 0 to image 1.

        In training there is one after each iteration, the last being the best; otherwise only the last.

        Args:
            image_0: [N, 3, H, W] in [-1, 1]; H and W are multiples of 8, from 128 up: in a smaller image the
                top of the pyramid would be empty.
            image_1: the same.
            iterations: corrections of the flow.
        """
        both = self.features(torch.cat([image_0, image_1]))
        features_0, features_1 = both.float().chunk(2)
        correlation = Correlation(features_0, features_1, self.size.lookup_radius)
        hidden, context = self.context(image_0).split([self.size.hidden, self.size.context], dim=1)
        hidden, context = torch.tanh(hidden), torch.relu(context)
        n, _, h, w = hidden.shape
        start = _pixels(n, h, w, image_0.device)
        target, flows = start, []
        for iteration in range(iterations):
            target = target.detach()
            flow = target - start
            motion = self.motion(flow, correlation.around(target))
            for gru in self.gru:
                hidden = gru(hidden, torch.cat([context, motion], dim=1))
            target = target + self.flow_head(hidden).float()
            if self.training or iteration == iterations - 1:
                flows.append(self._full_size(target - start, hidden))
        return flows

    def _full_size(self, flow: Tensor, hidden: Tensor) -> Tensor:
        """Flow of an eighth of the size [N, 2, h, w], in its pixels, as [N, 2, H, W] in the image's."""
        flow = STRIDE * flow
        if self.upsampling is None:
            return functional.interpolate(flow, scale_factor=STRIDE, mode="bilinear", align_corners=True)
        # Each pixel takes a weighted mean of the nine coarse neighbours; the weights are learned.
        n, _, h, w = flow.shape
        # A quarter: the paper's way of keeping the gradients of the weights small.
        weights = (0.25 * self.upsampling(hidden)).float().view(n, 1, 9, STRIDE, STRIDE, h, w).softmax(dim=2)
        neighbours = functional.unfold(flow, 3, padding=1).view(n, 2, 9, 1, 1, h, w)
        fine = (weights * neighbours).sum(dim=2)  # [N, 2, 8, 8, h, w]
        return fine.permute(0, 1, 4, 2, 5, 3).reshape(n, 2, STRIDE * h, STRIDE * w)


class Correlation:
    """Dot products of all features of image 0 with all of image 1, and with ever coarser means of them."""

    def __init__(self, features_0: Tensor, features_1: Tensor, radius: int) -> None:
        n, channels, h, w = features_0.shape
        # Differences between good matches are small: full precision here, whatever the network has elsewhere.
        with torch.autocast(features_0.device.type, enabled=False):
            dots = features_0.flatten(2).transpose(1, 2) @ features_1.flatten(2)
        level = (dots / channels**0.5).view(n * h * w, 1, h, w)
        self._levels = [level]
        for _ in range(PYRAMID_LEVELS - 1):
            level = functional.avg_pool2d(level, 2)
            self._levels.append(level)
        offset = torch.arange(-radius, radius + 1, device=features_0.device, dtype=features_0.dtype)
        # Channel by channel u changes slowly, v fast: the public weights have learned it so.
        self._offsets = torch.stack(torch.meshgrid(offset, offset, indexing="ij"), dim=-1)

    def around(self, target: Tensor) -> Tensor:
        """Correlations [N, levels * (2 radius + 1)^2, h, w] in a square around targets (u, v) [N, 2, h, w]."""
        n, _, h, w = target.shape
        centre = target.permute(0, 2, 3, 1).reshape(n * h * w, 1, 1, 2)
        looked_up = []
        for number, level in enumerate(self._levels):
            rows, columns = level.shape[-2:]
            uv = centre / 2**number + self._offsets
            last = torch.tensor([columns - 1, rows - 1], device=uv.device, dtype=uv.dtype)
            found = functional.grid_sample(level, 2 * uv / last - 1, align_corners=True)
            looked_up.append(found.view(n, h, w, -1))
        return torch.cat(looked_up, dim=-1).permute(0, 3, 1, 2)


def _pixels(n: int, h: int, w: int, device: torch.device) -> Tensor:
    """The coordinates (u, v) of every pixel, [N, 2, h, w]."""
    v, u = torch.meshgrid(
        torch.arange(h, device=device, dtype=torch.float32),
        torch.arange(w, device=device, dtype=torch.float32),
        indexing="ij",
    )
    return torch.stack([u, v]).expand(n, 2, h, w)


class _NormedConv(nn.Module):
    """Convolution, normalisation and, where wanted, a rectifier."""

    def __init__(
        self, channels_in: int, channels: int, kernel: int, stride: int, norm: Norm, relu: bool = True
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(channels_in, channels, kernel, stride, padding=kernel // 2)
        self.norm = norm(channels)
        self._relu = relu

    def forward(self, x: Tensor) -> Tensor:
        x = self.norm(self.conv(x))
        return torch.relu(x) if self._relu else x


class _Residual(nn.Module):
    """What a few convolutions add to their input; the small network's go through a bottleneck."""

    def __init__(self, channels_in: int, channels: int, stride: int, size: RaftSize, norm: Norm) -> None:
        super().__init__()
        if size.is_large:
            shapes = [(channels_in, channels, 3, stride), (channels, channels, 3, 1)]
        else:
            narrow = channels // 4
            shapes = [(channels_in, narrow, 1, 1), (narrow, narrow, 3, stride), (narrow, channels, 1, 1)]
        self.convs = nn.Sequential(*(_NormedConv(*shape, norm) for shape in shapes))
        self.shortcut = (
            nn.Identity() if stride == 1 else _NormedConv(channels_in, channels, 1, stride, norm, relu=False)
        )

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(self.shortcut(x) + self.convs(x))


class _Encoder(nn.Module):
    """An image [N, 3, H, W] to features [N, channels, H / 8, W / 8]."""

    def __init__(self, size: RaftSize, channels: int, norm: Norm) -> None:
        super().__init__()
        self.stem = _NormedConv(3, size.stem, 7, 2, norm)
        widths = (size.stem, *size.stages)
        self.stages = nn.Sequential(
            *(
                nn.Sequential(
                    _Residual(widths[k], widths[k + 1], 1 if k == 0 else 2, size, norm),
                    _Residual(widths[k + 1], widths[k + 1], 1, size, norm),
                )
                for k in range(3)
            )
        )
        self.last = nn.Conv2d(widths[-1], channels, 1)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):  # else the signal fades on its way, and learning takes far longer
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, image: Tensor) -> Tensor:
        return self.last(self.stages(self.stem(image)))


class _MotionEncoder(nn.Module):
    """The present flow and what was looked up around it, as features."""

    def __init__(self, size: RaftSize) -> None:
        super().__init__()
        looked_up = PYRAMID_LEVELS * (2 * size.lookup_radius + 1) ** 2
        widths = (looked_up, *size.correlation)
        self.correlation = nn.ModuleList(
            nn.Conv2d(widths[k], widths[k + 1], (1, 3)[k], padding=(0, 1)[k])
            for k in range(len(size.correlation))
        )
        self.flow = nn.ModuleList(
            (
                nn.Conv2d(2, size.flow[0], 7, padding=3),
                nn.Conv2d(size.flow[0], size.flow[1], 3, padding=1),
            )
        )
        self.join = nn.Conv2d(size.correlation[-1] + size.flow[-1], size.motion - 2, 3, padding=1)

    def forward(self, flow: Tensor, looked_up: Tensor) -> Tensor:
        c, f = looked_up, flow
        for conv in self.correlation:
            c = torch.relu(conv(c))
        for conv in self.flow:
            f = torch.relu(conv(f))
        return torch.cat([torch.relu(self.join(torch.cat([c, f], dim=1))), flow], dim=1)


class _ConvGru(nn.Module):
    """A gated recurrent unit whose products are convolutions."""

    def __init__(self, hidden: int, channels: int, kernel: tuple[int, int]) -> None:
        super().__init__()
        self.update, self.reset, self.candidate = (
            nn.Conv2d(hidden + channels, hidden, kernel, padding=(kernel[0] // 2, kernel[1] // 2))
            for _ in range(3)
        )

    def forward(self, hidden: Tensor, x: Tensor) -> Tensor:
        both = torch.cat([hidden, x], dim=1)
        z, r = torch.sigmoid(self.update(both)), torch.sigmoid(self.reset(both))
        q = torch.tanh(self.candidate(torch.cat([r * hidden, x], dim=1)))
        return (1 - z) * hidden + z * q


class _FlowHead(nn.Module):
    """The correction of the flow that the hidden state stands for."""

    def __init__(self, size: RaftSize) -> None:
        super().__init__()
        self.convs = nn.Sequential(
            nn.Conv2d(size.hidden, size.flow_head, 3, padding=1),
            nn.ReLU(),
            nn.Conv2d(size.flow_head, 2, 3, padding=1),
        )

    def forward(self, hidden: Tensor) -> Tensor:
        return self.convs(hidden)
