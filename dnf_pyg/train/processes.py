"""Leave the other processes of a run in good order."""

import atexit
import gc

import torch

__all__ = ["leave_at_exit"]


def leave_at_exit() -> None:
    """Have the process groups, if there are any by then, end before the interpreter does.

    Calling it again changes nothing.

    The threads of a gloo group drop the tensors of the last exchange when they get to it. Where the interpreter has
    begun to end by then, the process aborts ("terminate called without an active exception", status -6), and takes
    the others with it. Destroying a group waits for its threads, unless somebody else holds the group: a module that
    needs one keeps a weak reference. Lightning destroys the groups of NCCL alone.

    Source: https://github.com/pytorch/pytorch/issues/190489.
    """
    atexit.unregister(_leave)
    atexit.register(_leave)


def _leave() -> None:
    if torch.distributed.is_available() and torch.distributed.is_initialized():
        gc.collect()  # what wrapped a model for several processes holds the group, in a cycle
        torch.distributed.destroy_process_group()
