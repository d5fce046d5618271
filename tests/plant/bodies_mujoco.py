"""The whole machine once more in MuJoCo: nine tendons over cylinders that face their attachment.

The pulleys are mocap bodies, turned towards the platform before every step; forces come from
tendon actuators, elastic cables and the spring from tendon stiffness.
"""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from cdhr_host.plant.bodies import BodiesState, Build
from cdhr_host.profile import Profile

LEAD = 0.3


class Twin:
    def __init__(self, profile: Profile, build: Build, stiffness: Sequence[float], dt: float) -> None:
        """``stiffness`` (9,) N/m of the cables; 0 for cables that are driven by force."""
        self.profile, self.build, self.stiffness = profile, build, stiffness
        self.model = mujoco.MjModel.from_xml_string(self.xml(dt))
        self.data = mujoco.MjData(self.model)
        self.sites = [self.model.site(f"end{i}").id for i in range(9)]
        self.anchors = np.array([self.anchor(i) for i in range(9)])

    def anchor(self, i: int) -> tuple[float, float, float]:
        shape, beta = self.profile.geometry, 2 * math.pi * (i % 3) / 3
        along = (0.055, -0.055, 0.0)[i // 3]
        x, y = shape.pulley_circle_radius, along
        height = shape.upper_pulley_height if i > 5 else shape.lower_pulley_height
        c, s = math.cos(beta), math.sin(beta)
        return c * x - s * y, s * x + c * y, height

    def arm(self, i: int) -> tuple[float, float, float]:
        beta, along = 2 * math.pi * (i % 3) / 3, (0.055, -0.055, 0.0)[i // 3]
        c, s, r = math.cos(beta), math.sin(beta), self.profile.geometry.lower_attachment_radius
        return (c * r - s * along, s * r + c * along, -self.build.mass_height) if i < 6 else (0.0, 0.0, 0.0)

    def xml(self, dt: float) -> str:
        shape, mass, build = self.profile.geometry, self.profile.platforms, self.build
        spring = self.profile.spring
        wheel, top = shape.pulley_radius, shape.reference_height + shape.reference_separation
        pulleys, ends = "", ["", ""]
        for i in range(9):
            k = 1 if i > 5 else -1
            x, y, z = self.anchor(i)
            pulleys += (
                f'<body name="pulley{i}" mocap="true" pos="{x!r} {y!r} {z!r}">'
                f'<geom name="wheel{i}" type="cylinder" size="{wheel} 0.002" euler="90 0 0" '
                f'contype="0" conaffinity="0"/><site name="lead{i}" pos="{LEAD} 0 {k * wheel}"/>'
                f'<site name="side{i}" pos="{-2 * wheel} 0 {2 * k * wheel}"/></body>'
            )
            a, b, c = self.arm(i)
            ends[i > 5] += f'<site name="end{i}" pos="{a!r} {b!r} {c!r}"/>'
        across, about, h = build.inertia_across, build.inertia_about, build.mass_height
        slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
        tendons = "".join(
            f'<spatial name="cable{i}" stiffness="{k!r}" damping="{k * build.damping!r}" '
            f'springlength="0 {9.0 if k else 0.0}"><site site="lead{i}"/>'
            f'<geom geom="wheel{i}" sidesite="side{i}"/>'
            f'<site site="end{i}"/></spatial>'
            for i, k in enumerate(self.stiffness)
        )
        motors = "".join(f'<motor tendon="cable{i}" gear="-1"/>' for i in range(9))
        return f"""<mujoco><option timestep="{dt}" gravity="0 0 -9.81" integrator="RK4"/><worldbody>{pulleys}
          <body pos="0 0 {shape.reference_height + h!r}"><freejoint/>
            <inertial pos="0 0 0" mass="{mass.lower_mass}" diaginertia="{across} {across} {about}"/>
            <site name="low" pos="0 0 {-h!r}"/>{ends[0]}</body>
          <body pos="0 0 {top!r}">{slides}
            <inertial pos="0 0 0" mass="{mass.upper_mass}" diaginertia="1 1 1"/>
            <site name="high"/>{ends[1]}</body>
        </worldbody><tendon>{tendons}
          <spatial stiffness="{spring.stiffness}" springlength="{spring.rest_length}">
            <site site="low"/><site site="high"/></spatial>
        </tendon><actuator>{motors}</actuator></mujoco>"""

    def place(self, state: BodiesState) -> None:
        height = self.profile.geometry.reference_height + self.build.mass_height
        x, y, z = state.lower
        self.data.qpos[:] = [x, y, z + height, *state.turn, *state.upper]
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, np.array(state.turn))
        self.data.qvel[:] = [
            *state.velocity,
            *(axes.reshape(3, 3).T @ np.array(state.spin)),
            *state.upper_velocity,
        ]

    def face(self) -> None:
        """Turn the pulleys to where their attachments will be in the middle of the step."""
        now = self.data.qpos.copy()
        mujoco.mj_integratePos(self.model, self.data.qpos, self.data.qvel, 0.5 * self.model.opt.timestep)
        mujoco.mj_kinematics(self.model, self.data)
        away = self.anchors - self.data.site_xpos[self.sites]
        half = 0.5 * np.arctan2(away[:, 1], away[:, 0])
        self.data.mocap_quat[:] = np.column_stack([np.cos(half), np.zeros(9), np.zeros(9), np.sin(half)])
        self.data.qpos[:] = now

    def push(self, force: Sequence[float]) -> None:
        """A step under nine given forces."""
        self.face()
        self.data.ctrl[:] = force
        mujoco.mj_step(self.model, self.data)

    def pull(self, natural: Sequence[float]) -> None:
        """A step on elastic cables of these unloaded lengths; they cannot push."""
        self.face()
        self.model.tendon_lengthspring[:9, 1] = np.array(natural) + LEAD
        mujoco.mj_step(self.model, self.data)

    def state(self) -> BodiesState:
        q, v = self.data.qpos, self.data.qvel
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, q[3:7])
        height = self.profile.geometry.reference_height + self.build.mass_height
        return BodiesState(
            (q[0], q[1], q[2] - height),
            tuple(q[3:7]),
            tuple(v[:3]),
            tuple(axes.reshape(3, 3) @ v[3:6]),
            tuple(q[7:10]),
            tuple(v[6:9]),
        )
