"""Where and in which precision to compute."""

from contextlib import AbstractContextManager, nullcontext

import torch
from torch import nn

from afferents.errors import InputError
from afferents.models.config import TrainingConfig


def choose_device(config: TrainingConfig) -> torch.device:
    """Return the device that the configuration names.

    Raises
    ------
    InputError
        If it names a GPU and there is none.
    """
    available = torch.cuda.is_available()
    if config.device == "cuda" and not available:
        raise InputError("device: expected a CUDA GPU, found none; use device 'auto' or 'cpu'")
    return torch.device("cuda" if available and config.device != "cpu" else "cpu")


def is_out_of_memory(error: Exception) -> bool:
    """Return whether an error reports that memory is short, of the GPU or of the machine."""
    short = isinstance(error, MemoryError | torch.OutOfMemoryError)
    return short or "can't allocate memory" in str(error)


def has_bfloat16(device: torch.device) -> bool:
    """Return whether the device multiplies bfloat16 natively; emulation would be slower.

    A processor that could, but whose newer instructions oneDNN is kept from, does not.
    """
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    if not hasattr(torch.cpu, "get_capabilities"):  # an older PyTorch cannot tell
        return False
    capabilities = torch.cpu.get_capabilities()
    native = any(capabilities.get(name, False) for name in ("avx512_bf16", "amx_bf16"))
    return native and takes_bfloat16()


def takes_bfloat16() -> bool:
    """Return whether oneDNN, which multiplies for PyTorch on a CPU, is at home in bfloat16.

    It is from AVX-512 on, unless the environment keeps it from that (ONEDNN_MAX_CPU_ISA).
    Below it computes convolutions and dense layers in bfloat16 slowly, and LSTMs not at all.
    """
    is_supported = getattr(torch.ops.mkldnn, "_is_mkldnn_bf16_supported", None)
    return is_supported is not None and bool(is_supported())


def autocast(config: TrainingConfig, device: torch.device) -> AbstractContextManager[object]:
    """Return the context in which the network runs: bfloat16 or plain float32."""
    chosen = config.precision == "bfloat16"
    if chosen or (config.precision == "auto" and has_bfloat16(device)):
        return torch.autocast(device.type, dtype=torch.bfloat16)
    return nullcontext()


def describe_computing(config: TrainingConfig) -> dict[str, str]:
    """Return device, precision and PyTorch version, for the record of a training."""
    device = choose_device(config)
    precision = "float32" if isinstance(autocast(config, device), nullcontext) else "bfloat16"
    return {"device": device.type, "precision": precision, "torch": torch.__version__}


def use_channels_last(model: nn.Module) -> nn.Module:
    """Lay a network's kernels out with the channel running fastest, in place; return it.

    Convolutions then keep their maps so as well, which is faster on CPU and GPU.
    """
    return model.to(memory_format=torch.channels_last)  # type: ignore[call-overload, no-any-return]
