"""The youBot's arm by strapd against pinocchio, on a URDF written here with the same numbers.

    python youbot_dynamics.py path/to/strapd [count]

Random joints, rates, accelerations and forces at the tool go through `strapd model youbot` (fk, jacobian,
dynamics; both presets, both joint conventions) and through pinocchio; the largest difference of each
quantity is printed. Exit code 0 when all are within 1e-12. With `--time`, pinocchio's rnea is timed.

Made and last run with: Python 3.11, pin 4.1.0, numpy 2.4.6.
"""

import json
import subprocess
import sys
import time

import numpy as np
import pinocchio as pin

TOLERANCE = 1e-12
GRAVITY = [0.0, 0.0, -9.81]
ZERO = np.radians([169.0, 65.0, -146.0, 192.5, 167.5])

# mass, centre of mass, principal inertia; link axes of the standard Denavit-Hartenberg frames.
LINKS = [
    (1.390, [-0.01811, -0.01687, -0.00213], [2.9525e-3, 5.8821e-3, 6.0091e-3]),
    (1.318, [-0.06903, -0.01053, 0.03070], [3.1631e-3, 3.1145e-3, 5.843e-4]),
    (0.821, [-0.06393, -0.00010, -0.02070], [1.8468e-3, 1.72767e-3, 4.1967e-4]),
    (0.769, [-0.00011, 0.02, 0.05019], [6.764e-4, 1.0573e-3, 6.610e-4]),
    (0.687, [0.0, -0.00115, 0.11317], [1.934e-4, 1.602e-4, 6.89e-5]),
]


def rotation(axis, angle):
    return pin.AngleAxis(angle, np.array(axis, float)).toRotationMatrix()


def urdf(preset):
    """A chain whose link frames have z on the joint: the frame before a joint is (i-1) turned by theta's
    offset; what follows the joint (a, d, alpha) is the next joint's origin."""
    a4, d1, d5 = {"seed": (0.0, 0.147, 0.218), "urdf": (0.002, 0.115, 0.130)}[preset]
    quarter = np.pi / 2
    table = [  # a, alpha, d, offset
        (0.033, quarter, d1, 0.0),
        (0.155, 0.0, 0.0, quarter),
        (0.135, 0.0, 0.0, 0.0),
        (a4, quarter, 0.0, 0.0),
        (0.0, 0.0, d5, 0.0),
    ]
    text = ['<robot name="youbot"><link name="base"/>']
    before = pin.SE3.Identity()  # from the last joint's frame to the link frame it carries
    parent = "base"
    for i, ((a, alpha, d, offset), (mass, com, inertia)) in enumerate(zip(table, LINKS)):
        joint = before * pin.SE3(rotation([0, 0, 1], offset), np.zeros(3))
        carried = pin.SE3(rotation([1, 0, 0], alpha), np.array([a, 0.0, d]))
        com = np.array(com)
        if i == 3:
            com = com - [a4, 0, 0]
        if i == 4:
            com = com - [0, 0, d5]
        place = carried * pin.SE3(np.eye(3), com)
        text.append(
            f'<link name="link{i}"><inertial>{origin(place)}<mass value="{mass!r}"/>'
            f'<inertia ixx="{inertia[0]!r}" iyy="{inertia[1]!r}" izz="{inertia[2]!r}" ixy="0" ixz="0" iyz="0"/>'
            f"</inertial></link>"
            f'<joint name="joint{i}" type="continuous"><parent link="{parent}"/><child link="link{i}"/>'
            f'{origin(joint)}<axis xyz="0 0 1"/></joint>'
        )
        before, parent = carried, f"link{i}"
    text.append(
        f'<link name="tool"/><joint name="tool" type="fixed"><parent link="{parent}"/><child link="tool"/>'
        f"{origin(before)}</joint></robot>"
    )
    return "".join(text)


def origin(t):
    xyz = " ".join(repr(float(x)) for x in t.translation)
    rpy = " ".join(repr(float(x)) for x in pin.rpy.matrixToRpy(t.rotation))
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def model(preset):
    """Continuous joints would carry sine and cosine as state; revolute ones without stops do not."""
    text = urdf(preset).replace('type="continuous"', 'type="revolute"')
    limit = '<limit lower="-10" upper="10" effort="100" velocity="100"/></joint>'
    text = text.replace('<axis xyz="0 0 1"/></joint>', '<axis xyz="0 0 1"/>' + limit)
    m = pin.buildModelFromXML(text)
    m.gravity.linear = np.array(GRAVITY)
    return m


def ask(strapd, question, requests):
    lines = "".join(json.dumps(r) + "\n" for r in requests)
    ran = subprocess.run(
        [strapd, "model", "youbot", question], input=lines, capture_output=True, text=True, check=True
    )
    return [json.loads(line) for line in ran.stdout.splitlines()]


def compare(strapd, preset, convention, count, worst):
    m = model(preset)
    data = m.createData()
    tool = m.getFrameId("tool", pin.FrameType.BODY)
    rng = np.random.default_rng(7)
    low = np.radians([-169, -90, -146, -12.5, -167.5])
    high = np.radians([169, 65, 151, 192.5, 167.5])
    sign = 1.0 if convention == "seed" else -1.0
    cases, requests = [], []
    for _ in range(count):
        q = rng.uniform(low, high)
        qd, qdd = rng.uniform(-2, 2, 5), rng.uniform(-3, 3, 5)
        force, moment = rng.uniform(-5, 5, 3), rng.uniform(-1, 1, 3)
        cases.append((q, qd, qdd, force, moment))
        said = q if convention == "seed" else ZERO - q
        requests.append(
            {
                "q": list(said), "qd": list(sign * qd), "qdd": list(sign * qdd), "gravity": GRAVITY,
                "preset": preset, "joints": convention,
                "tip": {"force": list(force), "moment": list(moment)},
            }
        )
    place = [{k: r[k] for k in ("q", "preset", "joints")} for r in requests]
    answers = zip(ask(strapd, "fk", place), ask(strapd, "jacobian", place), ask(strapd, "dynamics", requests))
    for (q, qd, qdd, force, moment), (fk, jacobian, dynamics) in zip(cases, answers):
        # The force on the arm is the opposite of the force of the tool on the world.
        tau = pin.rnea(m, data, q, qd, qdd)
        pin.forwardKinematics(m, data, q, qd, qdd)
        pin.updateFramePlacements(m, data)
        t = data.oMf[tool]
        local = pin.computeFrameJacobian(m, data, q, tool, pin.ReferenceFrame.LOCAL)
        tau = tau + local.T @ np.concatenate([force, moment])
        world = pin.computeFrameJacobian(m, data, q, tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        mass = pin.crba(m, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        velocity = pin.getFrameVelocity(m, data, tool, pin.ReferenceFrame.LOCAL)
        acceleration = pin.getFrameClassicalAcceleration(m, data, tool, pin.ReferenceFrame.LOCAL)
        feels = acceleration.linear - t.rotation.T @ np.array(GRAVITY)
        gravity = pin.computeGeneralizedGravity(m, data, q)
        pairs = {
            "position (m)": (fk["p"], t.translation),
            "rotation": (fk["r"], t.rotation),
            "jacobian": (jacobian["jacobian"], sign * world),
            "torque (N m)": (dynamics["tau"], sign * tau),
            "gravity torque (N m)": (dynamics["gravity_torques"], sign * gravity),
            "mass matrix (kg m^2)": (dynamics["mass_matrix"], mass),
            "kinetic energy (J)": (dynamics["energy"]["kinetic"], pin.computeKineticEnergy(m, data, q, qd)),
            "gyro (rad/s)": (dynamics["gyro"], velocity.angular),
            "accelerometer (m/s^2)": (dynamics["accel"], feels),
        }
        for name, (ours, theirs) in pairs.items():
            off = float(np.max(np.abs(np.array(ours) - np.array(theirs))))
            worst[name] = max(worst.get(name, 0.0), off)


def clock():
    m = model("urdf")
    data = m.createData()
    rng = np.random.default_rng(1)
    states = [[rng.uniform(-1, 1, 5) for _ in range(3)] for _ in range(1000)]
    rounds = []
    for _ in range(21):
        begun = time.perf_counter()
        for q, qd, qdd in states:
            pin.rnea(m, data, q, qd, qdd)
        rounds.append((time.perf_counter() - begun) / len(states))
    print(f"pinocchio rnea through Python: {sorted(rounds)[10] * 1e9:.0f} ns (median of 21 rounds)")


def main():
    arguments = [a for a in sys.argv[1:] if a != "--time"]
    count = int(arguments[1]) if len(arguments) > 1 else 500
    worst = {}
    for preset in ("seed", "urdf"):
        for convention in ("seed", "driver"):
            compare(arguments[0], preset, convention, count, worst)
    for name, off in worst.items():
        print(f"{name:24}{off:.1e}")
    if "--time" in sys.argv:
        clock()
    if max(worst.values()) > TOLERANCE:
        sys.exit(f"beyond {TOLERANCE}")
    print(f"{4 * count} random motions agree with pinocchio {pin.__version__} within {TOLERANCE}")


main()
