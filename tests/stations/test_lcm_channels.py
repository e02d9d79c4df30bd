import pytest
from pydrake.lcm import DrakeLcm

from riseg_drake.stations.lcm_channels import (
    RECEIVE_LIMIT,
    LcmConfig,
    LcmError,
    open_lcm,
    receive_buffer_wanted,
    receive_buffer_warning,
)


def test_defaults_are_the_drivers_channels_on_this_machine_with_a_large_buffer():
    config = LcmConfig(camera_serial="123")
    assert config.image_channel == "DRAKE_RGBD_CAMERA_IMAGES_123"
    assert (config.status_channel, config.command_channel) == ("PANDA_STATUS", "PANDA_COMMAND")
    assert "ttl=0" in config.url
    assert receive_buffer_wanted(config.url) >= 2**22


@pytest.mark.parametrize(
    ("limit", "words"), [(212992, "sysctl -w net.core.rmem_max=4194304"), (4194304, ""), (8388608, "")]
)
def test_a_system_limit_below_what_is_wanted_is_named_with_the_remedy(tmp_path, limit, words):
    file = tmp_path / RECEIVE_LIMIT.name
    file.write_text(f"{limit}\n")
    said = receive_buffer_warning(LcmConfig.url, file)
    assert (words in said) if words else said == ""
    assert "\n" not in said


def test_a_url_without_a_buffer_is_named(tmp_path):
    file = tmp_path / "rmem_max"
    file.write_text("8388608")
    assert "recv_buf_size" in receive_buffer_warning("udpm://239.255.76.67:7667?ttl=0", file)


def test_networks_without_such_buffers_are_not_judged(tmp_path):
    assert receive_buffer_warning("memq://") == ""
    assert receive_buffer_warning(LcmConfig.url, tmp_path / "nothing") == ""


@pytest.mark.parametrize(
    "url",
    [
        "nonsense://",
        "udpm://nonsense:7667?ttl=0",
        "udpm://127.0.0.1:7667?ttl=0",  # no group: nobody else would hear
        "udpm://239.255.76.67:port?ttl=0",
        "udpm://239.255.76.67:99999",
    ],
)
def test_a_url_that_lcm_refuses_is_said_in_one_line(url):
    with pytest.raises(LcmError, match=r"no LCM at '.*'; expected a URL such as 'udpm://239") as caught:
        open_lcm(LcmConfig(url=url))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("url", [LcmConfig.url, "udpm://", "udpm://239.255.76.67:7667", "memq://"])
def test_any_other_url_is_left_to_lcm(url):
    assert isinstance(open_lcm(LcmConfig(url=url)), DrakeLcm)
