"""A worker says what draws, and does not pretend to have a GPU."""

import subprocess
import sys

import pytest
from farfield_core.errors import FarfieldError
from farfield_worker.probe import is_software, probe


@pytest.mark.parametrize(
    ("name", "software"),
    [
        ("Mesa llvmpipe (LLVM 15.0.6, 256 bits) 4.5", True),
        ("Google Inc. ANGLE (SwiftShader Device) 4.5", True),
        ("VMware, Inc. softpipe 3.3", True),
        ("NVIDIA Corporation NVIDIA H100 80GB HBM3/PCIe/SSE2 4.6.0", False),
        ("AMD AMD Radeon RX 6800 (radeonsi) 4.6", False),
    ],
)
def test_software_is_known_by_its_name(name: str, software: bool) -> None:
    assert is_software(name) is software


def test_where_nothing_draws_the_reason_is_said(tmp_path: object) -> None:
    liar = (sys.executable, "-c", "import sys; sys.exit('no libEGL')")
    with pytest.raises(FarfieldError, match=r"^OpenGL could not be tried .*: no libEGL\.$"):
        probe(liar)
    refusal = (sys.executable, "-c", """print('{"error": "This machine offers no OpenGL."}')""")
    with pytest.raises(FarfieldError, match=r"^This machine offers no OpenGL\.$"):
        probe(refusal)


def test_a_software_renderer_is_refused_on_the_gpu_queue() -> None:
    renderer = probe()
    # nothing listens there: a worker that is not refused would try to connect for ever
    broker = "redis://127.0.0.1:9/0"
    command = [sys.executable, "-m", "farfield", "worker", "--device", "gpu", "--broker", broker]
    if not renderer.software:  # a machine with a GPU
        with pytest.raises(subprocess.TimeoutExpired):
            subprocess.run(command, check=False, capture_output=True, timeout=20)
        return
    answer = subprocess.run(command, check=False, capture_output=True, text=True, timeout=120)
    assert answer.returncode == 1
    said, refused = answer.stderr.strip().split("\n")
    assert said == f"Cells are drawn by {renderer.name}."
    assert refused.startswith("A worker with --device gpu needs a GPU, but ")
