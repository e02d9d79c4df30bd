"""Which optical flow a scenario asks for."""

from dataclasses import dataclass, field

from riseg_drake.learned.raft_flow import RaftFlowParameters, load_raft_flow
from riseg_drake.segmentation.optical_flow import DisFlow, DisFlowParameters, FlowMethod


@dataclass
class OpticalFlowParameters:
    """One of the methods, and what it needs."""

    kind: str = field(default="dis", metadata={"choices": ("dis", "raft")})
    """"dis" (dense inverse search, needs nothing) or "raft" (as in the paper; needs torch and weights)."""
    dis: DisFlowParameters = field(default_factory=DisFlowParameters)
    raft: RaftFlowParameters = field(default_factory=RaftFlowParameters)


def flow_method(parameters: OpticalFlowParameters) -> FlowMethod:
    """The method, ready to be used.

    Raises ModelError where RAFT lacks torch, weights or device, and ValueError for an unknown kind.
    """
    if parameters.kind == "raft":
        return load_raft_flow(parameters.raft)
    if parameters.kind != "dis":
        raise ValueError(f"no optical flow {parameters.kind!r}: choose dis or raft")
    return DisFlow(parameters.dis)
