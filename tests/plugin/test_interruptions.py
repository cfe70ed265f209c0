"""Ctrl-C while tables are built, of which MuJoCo knows nothing."""

import contextlib
import gc
import os
import signal
import threading
import time
import weakref
from dataclasses import replace

import mujoco
import pytest

import mjtactile
from mjtactile.fidelity import as_fidelity
from mjtactile.plugin import attributes

#: A fidelity that no other test uses, so that its table is asked for.
OWN = replace(as_fidelity("fast"), cells=21)


@pytest.fixture(autouse=True)
def interruptible():
    """Ctrl-C interrupts Python, also where the tests were started with it ignored, as in a shell's background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def two_pads() -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="finger"/></worldbody></mujoco>')
    mjtactile.attach_pad(spec, body="finger", name="first", fidelity="fast")
    mjtactile.attach_pad(spec, body="finger", name="second", pos=(0.1, 0.0, 0.0), fidelity=OWN)
    return spec


def interrupt(*_):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(10.0)  # which the signal ends


def stop(*_):
    raise SystemExit(3)


@pytest.mark.parametrize("work", ["compile", "MjData"])
@pytest.mark.parametrize(("build", "error"), [(interrupt, KeyboardInterrupt), (stop, SystemExit)])
def test_an_interrupted_build_interrupts_what_asked_for_it(monkeypatch, work, build, error):
    spec = two_pads()
    model = spec.compile() if work == "MjData" else None
    attributes._of_pad.cache_clear()
    began = []
    with monkeypatch.context() as patch:
        patch.setattr(attributes, "influence_matrices", lambda *_: (began.append(1), build()))
        with pytest.raises(error):
            spec.compile() if model is None else mujoco.MjData(model)
    assert len(began) == 1
    model = spec.compile()
    assert model.nsensordata == 2 * 676
    mujoco.mj_step(model, mujoco.MjData(model))


def test_an_interruption_is_let_go_once_it_was_raised(monkeypatch):
    class Stopped(KeyboardInterrupt):
        pass

    made = []

    def build(*_):
        error = Stopped()
        made.append(weakref.ref(error))
        raise error

    spec = two_pads()
    attributes._of_pad.cache_clear()
    monkeypatch.setattr(attributes, "influence_matrices", build)
    with contextlib.suppress(Stopped):
        spec.compile()
    gc.collect()
    assert [one() for one in made] == [None]


def test_where_nothing_can_be_raised_in_another_thread_the_model_is_refused(monkeypatch):
    spec, errors = two_pads(), []
    attributes._of_pad.cache_clear()
    monkeypatch.setattr(attributes, "influence_matrices", stop)

    def work() -> None:
        try:
            spec.compile()
        except ValueError as error:
            errors.append(str(error))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert "mjtactile.pad: SystemExit: 3" in errors[0]
