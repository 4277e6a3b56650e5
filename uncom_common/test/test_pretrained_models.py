# SPDX-License-Identifier: Apache-2.0
"""What is missing for a full model is named in one line with what to do about it."""

import socket

import pytest
from uncom_common.exceptions import ModelNotFoundError, NotInstalledError
from uncom_common.pretrained_models import load_pretrained, require


class Cached:
    """Loads as the classes of Transformers do; only what is on this machine."""

    @classmethod
    def from_pretrained(cls, name, *, local_files_only=False):
        if name != "cached":
            raise OSError(f"{name} is not here\n and more")
        return name, local_files_only


@pytest.fixture
def no_hub(monkeypatch):
    hub = pytest.importorskip("huggingface_hub.constants")
    with socket.socket() as taken:  # bound but not listening: whoever calls is refused
        taken.bind(("127.0.0.1", 0))
        monkeypatch.setattr(hub, "ENDPOINT", f"http://127.0.0.1:{taken.getsockname()[1]}")
        yield


def test_a_missing_library_is_named_with_what_installs_it():
    with pytest.raises(NotInstalledError, match=r"^no_such_library is not installed: run ./uncom setup --full$"):
        require("no_such_library.part")


def test_what_is_on_this_machine_is_loaded_without_the_network(no_hub):
    assert load_pretrained(Cached, "cached") == ("cached", True)


def test_weights_that_cannot_be_had_are_a_one_line_error(no_hub, tmp_path):
    with pytest.raises(ModelNotFoundError, match="the model hub cannot be reached") as caught:
        load_pretrained(Cached, "some/model")
    assert "\n" not in str(caught.value)
    with pytest.raises(ModelNotFoundError, match="in the folder"):
        load_pretrained(Cached, str(tmp_path))
