"""Ctrl-C waits for a safe moment, once."""

import os
import signal
import threading

import pytest

from gears3d.cli.interrupts import exit_code, orderly_ends, patient_interrupts


def press(number=signal.SIGINT):
    os.kill(os.getpid(), number)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_each_of_the_signals_ends_in_the_same_way_and_is_told_by_the_exit_code(name):
    number = getattr(signal, name)
    with orderly_ends():
        with pytest.raises((KeyboardInterrupt, SystemExit)):
            press(number)
        assert exit_code() == 128 + number
        with patient_interrupts() as check:
            press(number)
            with pytest.raises(KeyboardInterrupt):
                check()


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with orderly_ends(), patient_interrupts() as check:
            press(signal.SIGHUP)
            check()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


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
