"""Can this machine draw? Asked before Drake does, which ends the process where the answer is no."""

import ctypes
import os

PACKAGES = "libegl1 libgl1 libgl1-mesa-dri"

_EGL_PLATFORM_DEVICE = 0x313F
_EGL_FALSE = 0
_MOST_DEVICES = 16


class NoGraphicsError(RuntimeError):
    """The machine has no OpenGL through EGL; the message says what to install."""


def require_graphics() -> None:
    """Raise NoGraphicsError unless images can be drawn without a display (OpenGL through EGL)."""
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # Mesa's own complaints add nothing to our one line
    try:
        ctypes.CDLL("libGL.so.1")
        working = _some_device_starts(ctypes.CDLL("libEGL.so.1"))
    except OSError:
        working = False
    if not working:
        raise NoGraphicsError(
            "this machine cannot draw images (no OpenGL through EGL); "
            f"on Debian and Ubuntu install the packages {PACKAGES}"
        )


def _some_device_starts(egl: ctypes.CDLL) -> bool:
    """Whether EGL finds a graphics card, or Mesa's software renderer, that can be initialised."""
    address_of = egl.eglGetProcAddress
    address_of.argtypes, address_of.restype = [ctypes.c_char_p], ctypes.c_void_p
    query_address = address_of(b"eglQueryDevicesEXT")
    display_address = address_of(b"eglGetPlatformDisplayEXT")
    if not query_address or not display_address:
        return False
    query_devices = ctypes.CFUNCTYPE(
        ctypes.c_uint, ctypes.c_int, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_int)
    )(query_address)
    platform_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(
        display_address
    )
    initialize = egl.eglInitialize
    initialize.argtypes, initialize.restype = [ctypes.c_void_p] * 3, ctypes.c_uint

    devices = (ctypes.c_void_p * _MOST_DEVICES)()
    number = ctypes.c_int(0)
    if query_devices(_MOST_DEVICES, devices, ctypes.byref(number)) == _EGL_FALSE:
        return False
    displays = (platform_display(_EGL_PLATFORM_DEVICE, device, None) for device in devices[: number.value])
    return any(display and initialize(display, None, None) != _EGL_FALSE for display in displays)
