"""A seeded sample of random rigs with random effects: none fails, hangs or breaks the rig's laws.

`make fuzz` draws ten thousand.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.fuzz import balance
from benchmarks.fuzz.balance import OPEN, OPEN_MEMORY, judge
from benchmarks.fuzz.draws import Case, draw_case
from benchmarks.fuzz.rigs import verdict
from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.integrator import Disc, Kind, Trajectory, as_voltage, sampled_voltage, simulate

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """A hang is told by the clock, so what all cases need is compiled before."""
    verdict(draw_case(20261125, 0))


@pytest.mark.parametrize("number", range(60))
def test_a_drawn_rig_obeys_its_laws(number: int) -> None:
    found = verdict(draw_case(20261125, number))
    assert found["fault"] == "", found


# Each failed once: what it was is in docs/integrator.md. They were drawn from what the library held
# then, so their effects are named here.
LAST = (
    "drive_speed_loss", "upper_drag_above_speed", "drag_above_speed", "lower_lugre",
    "string_second_spring", "encoder_play_upper", "encoder_play_lower", "drive_resonance",
    "upper_viscous_damper", "lower_viscous_damper",
)  # fmt: skip
LATER = (
    "coasting", "commutation_ripple", "soft_saturation", "lower_gaussian_stribeck",
    "upper_gaussian_stribeck", *LAST,
)  # fmt: skip
BEFORE = [name for name in LIBRARY if name not in ("coasting", *LAST)]
FAILED = {
    (1, 31): ["brake_runout", "slew_limit", "upper_presliding"],
    (1, 138): ["upper_resonator", "amplifier_saturation", "encoder_delay_upper"],
    (1, 151): ["lower_disturbance", "upper_spring", "upper_friction_lag"],
    (1, 232): ["upper_presliding", "friction_settling", "friction_drift"],
    (1, 244): ["upper_friction_lag", "encoder_eccentricity_upper"],
    (1, 267): ["upper_presliding", "upper_load_friction"],
    (1, 286): ["actuator_lag", "slew_limit"],
    (1, 757): ["brake_runout", "friction_lag", "lower_asymmetry"],
    (7, 999): ["slew_limit"],
    (7, 7622): ["upper_friction_lag", "torque_pulse", "drive_braking_loss"],
    (7, 8659): ["slew_limit", "gear_eccentricity"],
}


@pytest.mark.parametrize("drawn", FAILED, ids=lambda d: f"seed {d[0]} case {d[1]}")
def test_a_rig_that_failed_once(drawn: tuple[int, int]) -> None:
    case = draw_case(*drawn, library=[name for name in LIBRARY if name not in LATER])
    assert [effect["id"] for effect in case.rig.effects] == FAILED[drawn]
    found = verdict(case)
    assert found["fault"] == "", found


def test_another_effects_switch_leaves_what_has_yielded_alone() -> None:
    """Case 29 of seed 7: a current limit begins as the disc breaks away to the other side."""
    presliding = {"id": "upper_presliding", "torque": 1e-3, "distance": 4e-5}
    limit = {"id": "current_limit", "level": 3.0, "back_emf": 1e-3}
    drive = sampled_voltage(np.array([0.0, 1.0, 2.0]), np.array([-2.0, 0.0, 4.5]), 3.0)
    rig = Rig(effects=(limit, presliding))
    run = simulate(rig, drive, 3.0, t_eval=np.array([1.99, 2.0 + 1e-9, 2.5]))
    assert run.state[0, 1] == 0.0
    assert run.inner[:, 0] == pytest.approx([-1.0, -1.0, 1.0], abs=1e-6)


def test_a_disc_that_a_quick_drive_turns_round_within_the_first_step() -> None:
    """Case 103 of seed 11, wide: in the first try the voltage rises on, far beyond its end."""
    rig = Rig(Tsl=10.0, T1=0.0, T2=0.0)
    offset, rate, volts = 2.0 * rig.Tsu + 0.1, 2e4, 1e-3
    effects = (
        {"id": "upper_offset", "torque": offset},
        {"id": "slew_limit", "rate": rate},
    )
    run = simulate(rig.replace(effects=effects), volts, 0.1, rate=100.0)

    def rates(t: float, y: np.ndarray) -> list[float]:
        u = min(rate * t, volts)
        friction = -(rig.Tsu - rig.dTsu) + (rig.bu - rig.dbu) * y[1]
        return [y[1], (rig.km * u - offset - friction - rig.ktheta * y[0]) / rig.Ju]

    risen = volts / rate
    early = solve_ivp(rates, (0.0, risen), np.zeros(2), rtol=1e-12, atol=1e-15)
    assert early.y[1, -1] < 0.0
    truth = solve_ivp(rates, (risen, 0.1), early.y[:, -1], rtol=1e-12, atol=1e-15, t_eval=run.t[1:])
    assert (truth.y[1] < 0.0).all()
    assert run.events.t == pytest.approx([risen], rel=1e-9)
    assert run.inner[1:, 0] == pytest.approx(volts, abs=1e-12)
    assert run.state[1:, :2] == pytest.approx(truth.y.T, abs=1e-9)


def test_a_motor_in_its_play_leaves_once_though_a_loss_differs_with_the_disc_at_rest() -> None:
    """Case 7538 of seed 37: a disc that nothing pulls on leans to both sides, half a loss each."""
    rig = Rig(dTsu=0.0, dbu=0.0)
    loss, share, own = 0.2, 0.3, 0.5
    play = {
        "id": "gear_backlash", "gap": 0.3, "motor_share": share, "frequency": 10.0,
        "friction_share": own, "damping": 0.2,
    }  # fmt: skip
    effects = ({"id": "drive_braking_loss", "loss": loss}, play)
    times = np.linspace(0.0, 0.14, 15)
    run = simulate(rig.replace(effects=effects), lambda t: t, 0.14, t_eval=times)
    driven = (1.0 - 0.5 * loss) * rig.km
    leaves = own * rig.Tsu / driven

    def rates(t: float, z: np.ndarray) -> list[float]:
        return [z[1], (driven * t - own * (rig.Tsu + rig.bu * z[1])) / (share * rig.Ju)]

    after = times > leaves
    truth = solve_ivp(
        rates, (leaves, 0.14), np.zeros(2), rtol=1e-12, atol=1e-14, t_eval=times[after]
    )
    assert (truth.y[0] < 0.15).all()
    assert run.events.where(Disc.EFFECT).t[-1] == pytest.approx(leaves, abs=1e-9)
    assert (run.inner[~after] == 0.0).all()
    assert run.inner[after] == pytest.approx(truth.y.T, abs=1e-9)


def test_a_grip_that_the_first_try_leaps_over_is_seen_before_the_disc_stops() -> None:
    """Case 4765 of seed 37, wide: friction that rises within the last 0.1 ms of a slip."""
    rig = Rig(friction="coulomb", Tsl=0.07, T1=0.0, T2=0.0, ktheta=0.06, Tsu=10.0)
    torque, velocity = 0.01, 2e-3
    grip = {"id": "lower_gaussian_stribeck", "torque": torque, "velocity": velocity}
    run = simulate(rig.replace(effects=(grip,)), 0.0, 1.0, initial=np.array([0.0, 0.0, 1.0, 0.0]))

    def rates(t: float, y: np.ndarray) -> list[float]:
        friction = rig.Tsl + rig.bl * y[1] + torque * np.exp(-((y[1] / velocity) ** 2))
        return [-y[1], (rig.ktheta * y[0] - friction) / rig.Jl]

    def stops(t: float, y: np.ndarray) -> float:
        return y[1]

    stops.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    start = np.array([0.0, 1.0])
    # At 0.4 s the disc still turns too fast for the grip: exp(-33).
    early = solve_ivp(rates, (0.0, 0.4), start, rtol=1e-12, atol=1e-14)
    truth = solve_ivp(
        rates, (0.4, 1.0), early.y[:, -1], method="DOP853", events=stops, rtol=1e-12, atol=1e-14,
        max_step=1e-5,
    )  # fmt: skip
    stop = run.events.where(Disc.LOWER, Kind.STICK)
    assert stop.t == pytest.approx(truth.t_events[0], abs=1e-9)
    assert stop.state[0, 0] == pytest.approx(truth.y_events[0][0, 0], abs=1e-9)


def test_samples_between_steps_are_as_good_as_steps_where_a_body_settles_quickly() -> None:
    """Case 5708 of seed 37, wide: steps were as long as twelve times the body's own time."""
    rig = Rig(
        km=2.2571, Ju=0.843, Tsu=0.0, dTsu=0.0, bu=0.318, dbu=0.0, Jl=0.153, ktheta=0.78,
        Tsl=0.0015, T1=0.0, T2=0.0, bl=0.1, friction="coulomb",
    )  # fmt: skip
    hertz, share, damping = 38.7, 0.1, 0.91
    body = {"id": "upper_resonator", "frequency": hertz, "share": share, "damping": damping}
    start, times = np.array([-2.0, 8.0, 6.0, 0.0]), np.linspace(0.0, 1.0, 1001)
    run = simulate(rig.replace(effects=(body,)), 2.0, 1.0, initial=start, t_eval=times)

    def rates(t: float, y: np.ndarray) -> list[float]:
        wave, slip = 2.0 * np.pi * hertz, y[4] - y[1]
        pull = wave * wave * y[3] + 2.0 * damping * wave * slip
        twist = rig.ktheta * y[0]
        drive = 2.0 * rig.km + share * rig.Ju * pull - rig.bu * y[1] - twist
        return [
            y[1] - y[2], drive / rig.Ju, (twist - rig.Tsl - rig.bl * y[2]) / rig.Jl, slip, -pull,
        ]  # fmt: skip

    begin = np.array([-2.0, 8.0, 6.0, 0.0, 8.0])
    truth = solve_ivp(rates, (0.0, 1.0), begin, rtol=1e-12, atol=1e-14, t_eval=times, max_step=2e-3)
    assert (truth.y[1:3] > 0.0).all()
    assert run.omega_u == pytest.approx(truth.y[1], abs=1e-8)
    assert run.inner == pytest.approx(truth.y[3:].T, abs=1e-7)


def test_a_disc_that_the_located_moment_leaves_short_of_rest_is_not_put_to_rest_there() -> None:
    """Case 745 of seed 39, wide: a grip that the try met at its end told the wrong moment."""
    case = draw_case(39, 745, wide=True, library=BEFORE)
    assert [e["id"] for e in case.rig.effects][1:] == ["string_play", "lower_gaussian_stribeck"]
    found = verdict(case)
    assert found["fault"] == "", found


@pytest.mark.parametrize(("speed", "jump"), [(-0.2, 0.124), (-0.19, 0.12)])
def test_a_grip_near_rest_stops_the_disc_when_it_comes_to_rest(speed: float, jump: float) -> None:
    """The fault of case 745 alone: the disc was put to rest 1.2 ms late, by the try's moment."""
    rig = Rig(
        km=1.6, Ju=0.9, Tsu=0.0, dTsu=0.0, bu=0.085, dbu=0.0, Jl=0.0077, ktheta=0.0152, Tsl=0.0,
        T1=0.0, T2=0.0, bl=0.001, friction="coulomb",
    )  # fmt: skip
    torque, width = 0.0108, 0.0013
    grip = {"id": "lower_gaussian_stribeck", "torque": torque, "velocity": width}
    start = np.array([0.429, -1e-3, speed])
    drive = sampled_voltage(np.array([0.0, jump]), np.array([-2.0, 2.0]), 0.6)
    run = simulate(rig.replace(effects=(grip,)), drive, 0.6, initial=np.append(start, 0.0))

    def rates(t: float, y: np.ndarray, volts: float) -> list[float]:
        pull = rig.ktheta * y[0]
        held = torque * np.exp(-((y[2] / width) ** 2)) - rig.bl * y[2]
        upper = (rig.km * volts - pull - rig.bu * y[1]) / rig.Ju
        return [y[1] - y[2], upper, (pull + held) / rig.Jl]

    def stops(t: float, y: np.ndarray, volts: float) -> float:
        return y[2]

    stops.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    y, exact = start, {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    # At 0.2 s the disc still turns too fast for the grip: exp(-200).
    for a, b, volts in ((0.0, jump, -2.0), (jump, 0.2, 2.0)):
        y = solve_ivp(rates, (a, b), y, args=(volts,), **exact).y[:, -1]
    assert y[2] < -14.0 * width
    truth = solve_ivp(
        rates, (0.2, 0.6), y, args=(2.0,), events=stops, max_step=2e-5, **exact
    )  # fmt: skip
    stop = run.events.where(Disc.LOWER, Kind.STICK)
    assert stop.t[:1] == pytest.approx(truth.t_events[0], abs=1e-9)
    assert stop.state[0, 0] == pytest.approx(truth.y_events[0][0, 0], abs=1e-9)


def test_a_motor_that_the_sides_of_a_disc_at_rest_push_apart_rings_down_and_stands() -> None:
    """The fault of case 2746 alone: a motor behind its gear, with friction of its own.

    The disc rests, and leans to the side to which the gear pulls it; by that share the motor's loss
    is that of the disc's one side. Where it stands, one side pushes it forward and one back.
    """
    loss, volts, share, own, hertz, damping = 0.8, 0.45, 0.3, 0.025, 3.0, 0.07
    rig = Rig(km=1.0, Tsu=1.0, dTsu=0.0, bu=0.1, dbu=0.0)
    braking = {"id": "drive_braking_loss", "loss": loss}
    gear = {
        "id": "gear_compliance", "frequency": hertz, "motor_share": share, "friction_share": own,
        "damping": damping,
    }  # fmt: skip
    run = simulate(rig.replace(effects=(braking, gear)), volts, 10.0, rate=50.0)
    wave, reduced = 2.0 * np.pi * hertz, share * (1.0 - share) * rig.Ju
    holds, moves = (1.0 - own) * rig.Tsu, own * rig.Tsu

    def pulled(z: np.ndarray) -> float:
        return reduced * wave * (wave * z[0] + 2.0 * damping * z[1])

    def pushed(z: np.ndarray) -> float:
        leans = 0.5 * (1.0 + pulled(z) / holds)
        return rig.km * volts * (1.0 - loss * (1.0 - leans)) - pulled(z)

    def rates(t: float, z: np.ndarray, side: int) -> list[float]:
        return [z[1], (pushed(z) - side * moves - own * rig.bu * z[1]) / (share * rig.Ju)]

    def turns(t: float, z: np.ndarray, side: int) -> float:
        return side * z[1] if t > began else 1.0

    turns.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    began, z, swings = 0.0, np.zeros(2), 0
    while abs(pushed(z)) > moves:
        found = solve_ivp(
            rates, (began, 10.0), z, args=(int(np.sign(pushed(z))),), events=turns,
            method="DOP853", rtol=1e-12, atol=1e-15,
        )  # fmt: skip
        began, z, swings = found.t[-1], np.array([found.y[0, -1], 0.0]), swings + 1
    sides = rig.km * volts - pulled(z), rig.km * volts * (1.0 - loss) - pulled(z)
    assert swings > 1 and sides[0] > moves and sides[1] < -moves
    assert run.stuck_u.all() and len(run.events) < 3 * swings + 5
    stands = run.t > began
    assert run.inner[stands] == pytest.approx(np.tile(z, (stands.sum(), 1)), abs=1e-9)


@pytest.mark.parametrize("wide", [False, True])
def test_a_motor_that_both_sides_of_a_disc_push_apart_stands(wide: bool) -> None:
    """Case 2746 of seed 39: it left by what held it on each side and stopped by their mean."""
    case = draw_case(39, 2746, wide=wide, library=BEFORE)
    assert {"drive_braking_loss", "gear_compliance"} < {e["id"] for e in case.rig.effects}
    found = verdict(case)
    assert found["fault"] == "" and found["events"] < 100, found


def test_samples_where_a_memory_fades_with_the_way_gone() -> None:
    """Case 1580 of seed 38, wide: while the twist rises, the memory is a function of it."""
    rig, width = Rig(friction="coulomb", Tsl=1.0, T1=0.0, T2=0.0, Ju=0.05), 0.005
    hysteresis = {"id": "string_hysteresis", "torque": 1e-3, "width": width}
    run = simulate(rig.replace(effects=(hysteresis,)), 8.0, 0.35, rate=2000.0)
    assert (np.diff(run.twist) > 0.0).all() and run.twist[-1] > 4.0
    assert run.inner[:, 0] == pytest.approx(1.0 - np.exp(-run.twist / width), abs=1e-8)


def test_samples_of_a_motor_that_began_at_rest_behind_a_stiff_gear() -> None:
    """Case 3856 of seed 38, wide: how fast it rings was asked while it stood."""
    rig = Rig(dTsu=0.0, dbu=0.0, Tsu=50.0, Jl=1.0, ktheta=0.05)
    share, own, hertz, damping = 0.3, 0.01, 150.0, 0.1
    gear = {
        "id": "gear_compliance", "frequency": hertz, "motor_share": share, "friction_share": own,
        "damping": damping,
    }  # fmt: skip
    run = simulate(rig.replace(effects=(gear,)), lambda t: t, 6.0, rate=500.0)
    leaves, reduced = own * rig.Tsu / rig.km, share * (1.0 - share) * rig.Ju
    wave = 2.0 * np.pi * hertz

    def rates(t: float, z: np.ndarray) -> list[float]:
        gear = reduced * (wave * wave * z[0] + 2.0 * damping * wave * z[1])
        drive = rig.km * t - own * (rig.Tsu + rig.bu * z[1])
        return [z[1], (drive - gear) / (share * rig.Ju)]

    after = run.t > leaves
    truth = solve_ivp(
        rates, (leaves, 6.0), np.zeros(2), method="DOP853", rtol=1e-12, atol=1e-15,
        t_eval=run.t[after],
    )  # fmt: skip
    assert run.stuck_u.all() and (truth.y[1] > 0.0).all()
    assert run.inner[after] == pytest.approx(truth.y.T, rel=0.0, abs=1e-6 * truth.y[1].max())


@pytest.mark.parametrize("share", [0.995, 1.0])
def test_a_disc_that_late_friction_holds_all_but_alone_creeps_and_leaves_once(share: float) -> None:
    """Case 4164 of seed 38, wide: it left before the share of the friction that it took was 1.

    What held it by then grew at once, for ever. It leaves where the friction that is to come, as
    fast as it comes, no longer keeps up with the pull, within the hundredth that rest holds more.
    """
    rig, time_constant = Rig(dTsu=0.0, dbu=0.0), 2e-3
    late = {
        "id": "upper_friction_lag", "torque": share * rig.Tsu, "time_constant": time_constant,
    }  # fmt: skip
    leaves, hundredth = rig.Tsu / rig.km - time_constant, 0.01 * late["torque"] / rig.km
    run = simulate(rig.replace(effects=(late,)), lambda t: t, 1.1 * leaves, rate=5000.0)
    slips = run.events.where(Disc.UPPER, Kind.SLIP)
    assert len(run.events) < 5 and len(slips) == 1
    assert leaves < slips.t[0] < leaves + 1.05 * hundredth
    resting = run.t < leaves
    assert run.stuck_u[resting].all()
    held = (rig.km * run.t - late["torque"] * run.inner[:, 0])[resting]
    assert np.abs(held).max() < 0.01 * late["torque"]


@pytest.mark.parametrize("given", [(38, 3971, False), (38, 2397, True)])
def test_a_voltage_that_just_equals_stiction_holds_the_disc(given: tuple[int, int, bool]) -> None:
    """It left by rounding and came back, twelve times each 1e-7 s."""
    case = draw_case(*given[:2], wide=given[2], library=BEFORE)
    rig = case.rig
    assert case.voltage(0.0) == (rig.Tsu + rig.dTsu) / rig.km
    run = simulate(rig, case.voltage, 10.0, initial=case.start)
    assert run.steps + len(run.events) < 1000
    assert run.state == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("time_constant", [3e-4, 1e-3, 5e-3])
def test_a_lagging_voltage_that_comes_to_equal_stiction_holds_the_disc(
    time_constant: float,
) -> None:
    """Case 708 of seed 42, wide: a lag's rounding let the disc go, over and over."""
    rig = Rig(
        km=1.7275596297968268, Ju=6.0, Tsu=1.4276900122174045, dTsu=0.0, bu=1.0, dbu=0.0, Jl=0.0077,
        ktheta=0.0565, Tsl=0.0, T1=0.0, T2=0.0, bl=0.001, friction="coulomb", clamp=True,
        effects=({"id": "actuator_lag", "time_constant": time_constant},),
    )  # fmt: skip
    run = simulate(rig, rig.Tsu / rig.km, 2.0)
    assert run.inner[-1, 0] == pytest.approx(rig.Tsu / rig.km, rel=1e-12)
    assert len(run.events) == 0 and (run.state == 0.0).all()


def test_the_judge_tells_a_motion_that_is_no_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """A speed that is wrong by a hundredth, and a disc that is held for ever, do not pass."""
    effects = ({"id": "friction_lag", "time_constant": 0.02},)
    case = Case(0, Rig(effects=effects), as_voltage(3.5, 0.0, 10.0), np.zeros(4), "constant")
    assert judge(case).energy < OPEN

    def faster(*args: object, **options: object) -> Trajectory:
        run = simulate(*args, **options)  # pyright: ignore
        return dataclasses.replace(run, state=run.state * [1.0, 1.0, 1.01, 1.0])

    def held(*args: object, **options: object) -> Trajectory:
        run = simulate(*args, **options)  # pyright: ignore
        return dataclasses.replace(run, state=0.0 * run.state, modes=0 * run.modes)

    monkeypatch.setattr(balance, "simulate", faster)
    assert judge(case).energy > 10.0 * OPEN
    monkeypatch.setattr(balance, "simulate", held)
    assert judge(case).held > 10.0 * OPEN


def test_what_the_judge_leaves_open_of_a_thousand_reversals_does_not_add_up() -> None:
    """Case 213 of seed 41: each panel was let err by a part in a million, all to the same side."""
    effects = (
        {"id": "upper_presliding", "torque": 1.1e-3, "distance": 3.6e-5},
        {"id": "upper_disturbance", "torque": 0.3, "phase": 0.5, "frequency": 53.0},
    )
    rig = Rig(
        km=1.0, Ju=0.0107, Tsu=0.131, dTsu=0.0, bu=0.368, dbu=0.11, Jl=1.4e-3, ktheta=0.62,
        Tsl=8e-3, T1=0.0, T2=0.0, friction="coulomb", effects=effects,
    )  # fmt: skip
    case = Case(0, rig, as_voltage(0.02, 0.0, 10.0), np.zeros(4), "constant")
    found = judge(case)
    assert found.energy < 0.1 * OPEN and found.memory < 0.1 * OPEN_MEMORY
