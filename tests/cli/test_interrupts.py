"""Ctrl-C waits for a safe moment, once."""

import os
import signal
import threading

import pytest

from gears3d.cli.interrupts import patient_interrupts


def press():
    os.kill(os.getpid(), signal.SIGINT)


def test_one_press_waits_for_the_check_and_is_spent_by_it():
    with patient_interrupts() as check:
        check()
        press()
        with pytest.raises(KeyboardInterrupt):
            check()
        check()


def test_a_second_press_does_not_wait():
    with patient_interrupts():
        press()
        with pytest.raises(KeyboardInterrupt):
            press()


def test_afterwards_everything_is_as_before():
    before = signal.getsignal(signal.SIGINT)
    with patient_interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_are_left_alone():
    seen = []

    def work():
        with patient_interrupts() as check:
            check()
            seen.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [True]
