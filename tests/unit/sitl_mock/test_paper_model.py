"""The paper's model against numbers worked out by hand from its corrected equations, and against the rigid body."""

import math

import pytest

from sitl_mock.geometry import to_euler
from sitl_mock.paper_model import PaperModel, PaperState, accelerations, to_vehicle_state
from sitl_mock.plant import VehicleParams, VehicleState
from sitl_mock.quadcopter import RigidBody

PARAMS = VehicleParams()
NO_DRAG = VehicleParams(linear_drag_n_s_m=0.0, angular_drag_nm_s_rad=0.0)
HOVER = PARAMS.hover_thrust_norm
CALM = (0.0, 0.0, 0.0)


def test_translation_by_hand():
    # roll 0.1, pitch 0.2, yaw 0.3, sum F = 10 N, m = 1 kg:
    # r3 = (c.3 s.2 c.1 + s.3 s.1, s.3 s.2 c.1 - c.3 s.1, c.2 c.1)
    #    = (0.9553365*0.1986693*0.9950042 + 0.2955202*0.0998334,
    #       0.2955202*0.1986693*0.9950042 - 0.9553365*0.0998334, 0.9800666*0.9950042)
    #    = (0.2183507, -0.0369570, 0.9751703)
    linear, _ = accelerations(NO_DRAG, CALM, (0.1, 0.2, 0.3), CALM, (1.0, 2.0, 3.0, 4.0), CALM)
    assert linear == pytest.approx((2.183507, -0.369570, 9.751703 - 9.81), abs=1e-6)


def test_rotation_by_hand():
    # forces 1, 2, 3, 4 N; l = 0.2 m, J = (0.025, 0.025, 0.03), |C| = 0.1 / 5 = 0.02 m
    # psi'' = 8 (-1+2+3-4) = 0; theta'' = 8 (-1-2+3+4) = 32; phi'' = -(2/3) (1-2+3-4) = 4/3
    _, angular = accelerations(NO_DRAG, CALM, CALM, CALM, (1.0, 2.0, 3.0, 4.0), CALM)
    assert angular == pytest.approx((0.0, 32.0, 4.0 / 3.0))
    _, damped = accelerations(PARAMS, CALM, CALM, (1.0, 2.0, 3.0), (0.0,) * 4, CALM)
    assert damped == pytest.approx((-1.0, -2.0, -2.5))


def test_friction_and_wind_by_hand():
    linear, _ = accelerations(PARAMS, (1.0, 2.0, 3.0), CALM, CALM, (0.0,) * 4, (4.0, 0.0, 0.0))
    assert linear == pytest.approx((3.0, -2.0, -3.0 - 9.81))


def test_conversion_to_ned_and_frd():
    state = PaperState((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.1, 0.2, 0.3), (0.0, 0.0, 1.0), (0.1, 0.2, 0.3, 0.4))
    seen = to_vehicle_state(state)
    assert seen.position_ned_m == (1.0, -2.0, -3.0)
    assert seen.velocity_ned_m_s == (4.0, -5.0, -6.0)
    assert to_euler(seen.quaternion) == pytest.approx((0.1, -0.2, -0.3))
    # yaw rate 1 at pitch 0.2, roll 0.1: p = -sin .2, q = sin .1 cos .2, r = cos .1 cos .2 (FLU)
    assert seen.rates_frd_rad_s == pytest.approx((-0.1986693, -0.0978434, -0.9751703), abs=1e-6)
    assert seen.motors == (0.1, 0.3, 0.2, 0.4)  # rotors 1 FR 2 FL 3 RL 4 RR as motors 1 FR 2 RL 3 FL 4 RR


@pytest.mark.parametrize(
    "offsets",
    [(0.0, 0.0, 0.0, 0.0), (-0.01, 0.01, 0.01, -0.01), (0.01, -0.01, 0.01, -0.01), (0.02, 0.02, -0.02, -0.02)],
    ids=["hover", "roll", "pitch", "yaw"],
)
def test_agrees_with_the_rigid_body_near_level(offsets):
    commands = tuple(HOVER + offset for offset in offsets)
    rigid = RigidBody(PARAMS, VehicleState((0.0, 0.0, -5.0), motors=(HOVER,) * 4, on_ground=False))
    paper = PaperModel(PARAMS, PaperState((0.0, 0.0, 5.0), rotors=(HOVER,) * 4, on_ground=False))
    for _ in range(60):
        rigid.step(commands, (1.0, 2.0, 0.0))
        paper.step(commands, (1.0, 2.0, 0.0))
    # as far as one is integrated by RK4 and the other in one go
    assert paper.state.position_ned_m == pytest.approx(rigid.state.position_ned_m, abs=5e-6)
    assert paper.state.velocity_ned_m_s == pytest.approx(rigid.state.velocity_ned_m_s, abs=1e-5)
    assert paper.state.quaternion == pytest.approx(rigid.state.quaternion, abs=5e-6)
    assert paper.state.rates_frd_rad_s == pytest.approx(rigid.state.rates_frd_rad_s, abs=5e-6)
    assert paper.state.motors == pytest.approx(rigid.state.motors)


def test_differs_from_the_rigid_body_when_tilted():
    # The paper accelerates Euler angles where a body has body rates: with 40 degrees of roll, a pitching moment
    # turns the heading of the rigid body and not that of the paper's model.
    commands = (HOVER + 0.02, HOVER - 0.02, HOVER + 0.02, HOVER - 0.02)
    roll = math.radians(40.0)
    rigid = RigidBody(
        PARAMS,
        VehicleState((0.0, 0.0, -50.0), on_ground=False, quaternion=(math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)),
    )
    paper = PaperModel(PARAMS, PaperState((0.0, 0.0, 50.0), CALM, (roll, 0.0, 0.0), on_ground=False))
    for _ in range(75):
        rigid.step(commands, CALM)
        paper.step(commands, CALM)
    assert abs(to_euler(rigid.state.quaternion)[2]) > 0.01
    assert to_euler(paper.state.quaternion)[2] == pytest.approx(0.0, abs=1e-9)


def test_ground_holds_it_and_it_lifts_off():
    plant = PaperModel(PARAMS)
    for _ in range(100):
        plant.step((0.9 * HOVER,) * 4, (5.0, 0.0, 0.0))
    assert plant.state.on_ground
    assert plant.state.position_ned_m == CALM
    for _ in range(100):
        plant.step((1.2 * HOVER,) * 4, CALM)
    assert plant.state.position_ned_m[2] < -0.01
    for _ in range(300):
        plant.step((0.0,) * 4, CALM)
    assert plant.state.on_ground
