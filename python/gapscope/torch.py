"""The laws of gapscope's plugins over tensors, for simulators that compute in PyTorch. Needs `torch`, 2.0 or newer.

Every function is pure and acts element by element on tensors of shape (envs, joints), in SI; parameters are numbers or
tensors on the same device that broadcast to it. Nothing is checked: a parameter out of range gives what the formula
gives. Each is the law of one stage of gapscope.motor, gapscope.friction or gapscope.spring (src/plugins). `Drive` runs
a servo's stages in the plugin's order. `import gapscope` does not import this module; exports write a copy of it, which
needs no gapscope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

import torch

Tensor: TypeAlias = Any  # torch.Tensor of shape (envs, joints)
Value: TypeAlias = Any  # a number, or a tensor that broadcasts to (envs, joints)


def _like(value: Value, x: Tensor) -> Tensor:
    return torch.as_tensor(value, dtype=x.dtype, device=x.device).expand_as(x)


def dead_zone(x: Tensor, half_width: Value) -> Tensor:
    """``x`` less ``half_width``, 0 inside; both in the unit of ``x``, shape (envs, joints)."""
    return torch.sign(x) * torch.clamp(x.abs() - half_width, min=0)


def by_direction(x: Tensor, asymmetry: Value) -> Tensor:
    """``x`` (1 + ``asymmetry`` sign x), in the unit of ``x``, shape (envs, joints); ``asymmetry`` in -1 .. 1."""
    return x * (1 + torch.sign(x) * asymmetry)


def late_command(history: Tensor, delay_s: Value, step_s: float) -> Tensor:
    """The mean over this step of commands that were held and come ``delay_s`` late, shape (envs, joints).

    ``history`` is of shape (steps, envs, joints), the present command first, in its own unit. It needs
    floor(delay / step) + 2 steps; a longer delay takes its oldest.
    """
    steps = _like(delay_s, history[0]) / step_s
    whole = torch.floor(steps + 1e-9)
    part = torch.clamp(steps - whole, min=0)
    last = len(history) - 1
    newer = history.gather(0, whole.long().clamp(0, last)[None])[0]
    older = history.gather(0, (whole.long() + 1).clamp(0, last)[None])[0]
    return (1 - part) * newer + part * older


def late_motion(angles: Tensor, speeds: Tensor, delay_s: Value, step_s: float) -> tuple[Tensor, Tensor]:
    """The angle and the speed ``delay_s`` ago, shape (envs, joints): a cubic through both, the speed on a line.

    ``angles`` in rad and ``speeds`` in rad/s are of shape (steps, envs, joints), the present first, as `late_command`.
    """
    steps = _like(delay_s, angles[0]) / step_s
    newer = torch.clamp(torch.floor(steps).long(), 0, len(angles) - 2)[None]
    s = torch.clamp(newer[0] + 1 - steps, 0, 1)  # of the way from the older sample to the newer one
    r = 1 - s
    (q0, q1), (w0, w1) = ((of.gather(0, newer + 1)[0], of.gather(0, newer)[0]) for of in (angles, speeds))
    angle = r * r * (1 + 2 * s) * q0 + s * s * (1 + 2 * r) * q1 + s * r * step_s * (r * w0 - s * w1)
    return angle, r * w0 + s * w1


def lag_output(state: Tensor, request: Tensor, time_constant_s: Value, step_s: float) -> Tensor:
    """What a lag of first order gives out in this step, in the unit of ``request``, shape (envs, joints).

    It is the state, and below one step a blend with the request, which at a time constant of 0 is the request.
    """
    weight = torch.clamp(_like(time_constant_s, request) / step_s, 0, 1)
    return request + weight * (state - request)


def lag_next(state: Tensor, request: Tensor, time_constant_s: Value, step_s: float) -> Tensor:
    """The lag's state after the step, exact for a held request, in the unit of ``request``, shape (envs, joints)."""
    constant = torch.clamp(_like(time_constant_s, request), min=step_s)
    return state - torch.expm1(-step_s / constant) * (request - state)


def power_limit(speed: Tensor, power_w: Value) -> Tensor:
    """The torque at which ``power_w`` is reached, N m, shape (envs, joints); infinite at rest. ``speed`` in rad/s."""
    size = speed.abs()
    return torch.where(size > 0, power_w / size, math.inf)


def trapeze_limit(speed: Tensor, peak_n_m: Value, rated: Value, no_load: Value) -> Tensor:
    """``peak_n_m`` up to the speed ``rated``, then a line to 0 at ``no_load``, shape (envs, joints), N m and rad/s.

    ``no_load`` of 0: the peak at all speeds.
    """
    size = speed.abs()
    peak, rated, no_load = _like(peak_n_m, speed), _like(rated, speed), _like(no_load, speed)
    line = peak * torch.clamp((no_load - size) / (no_load - rated), 0, 1)
    return torch.where((no_load <= 0) | (size <= rated), peak, torch.where(size >= no_load, 0.0, line))


def table_limit(speed: Tensor, speeds: Tensor, torques: Tensor) -> Tensor:
    """A torque over the speed's size by straight lines between points, held at the ends, shape (envs, joints), N m.

    ``speeds`` in rad/s and ``torques`` in N m are of shape (points,), ``speeds`` ascending.
    """
    size = speed.abs().clamp(speeds[0], speeds[-1])
    right = torch.searchsorted(speeds, size.contiguous(), right=True).clamp(1, len(speeds) - 1)
    share = (size - speeds[right - 1]) / (speeds[right] - speeds[right - 1])
    return (1 - share) * torques[right - 1] + share * torques[right]


def soft_limit(torque: Tensor, limit_n_m: Value, softness: Value) -> Tensor:
    """``torque`` within +-``limit_n_m``, shape (envs, joints), N m.

    The corner is a parabola from (1 - softness) to (1 + softness) times the limit; a softness of 0 is a sharp one.
    """
    limit = _like(limit_n_m, torque)
    half = torch.where(torch.isinf(limit), 0.0, _like(softness, torque) * limit)
    into = torque.abs() - (limit - half)
    corner = torque.abs() - into**2 / torch.where(half > 0, 4 * half, 1.0)
    size = torch.where(into > 0, torch.where(into >= 2 * half, limit, corner), torque.abs())
    return torch.copysign(size, torque)


def droop(torque: Tensor, loss: Value, reference_n_m: Value, exponent: Value = 1.0) -> Tensor:
    """A torque constant that falls: at ``reference_n_m`` the share ``loss`` is lost, shape (envs, joints), N m."""
    return torque * torch.clamp(1 - loss * (torque.abs() / reference_n_m) ** exponent, min=0)


def efficiency(torque: Tensor, speed: Tensor, drive: Value, backdrive: Value) -> Tensor:
    """What gears pass on of a torque, N m, shape (envs, joints): the share ``drive``, ``backdrive`` against speed."""
    return torque * torch.where(torque * speed < 0, _like(backdrive, torque), _like(drive, torque))


def winding(voltage: Tensor, speed: Tensor, kt: Value, ke: Value, resistance: Value, gear: Value = 1.0) -> Tensor:
    """The torque of a winding, N m at the joint, shape (envs, joints): V, rad/s, N m/A, V s/rad, ohm."""
    return gear * kt * (voltage - ke * gear * speed) / resistance


def duty_torque(
    error: Tensor,
    seen_speed: Tensor,
    speed: Tensor,
    duty_gain: Value,
    kt: Value,
    ke: Value,
    resistance: Value,
    supply_v: Value,
    duty_damping: Value = 0.0,
    duty_limit: Value = 1.0,
    gear: Value = 1.0,
) -> Tensor:
    """The torque of a servo that sets its duty cycle by its ``error``, rad: N m, shape (envs, joints), as `winding`.

    The duty is ``duty_gain`` error - ``duty_damping`` speed within +-``duty_limit``, 1/rad and s/rad, of ``supply_v``.
    Its damping is by ``seen_speed``, which may be late; the winding's back-EMF is by ``speed``, both in rad/s.
    """
    duty = duty_gain * error - duty_damping * seen_speed
    limit = _like(duty_limit, duty)
    return winding(torch.clamp(duty, min=-limit, max=limit) * supply_v, speed, kt, ke, resistance, gear)


def gear_friction(
    torque: Tensor,
    speed: Tensor,
    slope_n_m_s_per_rad: Value,
    load_coefficient: Value = 0.0,
    hump_n_m: Value = 0.0,
    hump_speed_rad_per_s: Value = 0.05,
) -> Tensor:
    """Friction by load and its hump at low speed, for a simulator whose own has neither: N m, shape (envs, joints).

    Its level is that of `dry_level`: ``load_coefficient`` times ``torque``, and a hump that ends at about
    ``hump_speed_rad_per_s``. At a speed below level / slope it is damping by the slope: it creeps where friction holds.
    """
    level = dry_level(speed, 0.0, hump_n_m, hump_speed_rad_per_s, load_n_m=torque, load_coefficient=load_coefficient)
    return torch.clamp(slope_n_m_s_per_rad * speed, min=-level, max=level)


def dry_level(
    speed: Tensor,
    coulomb_n_m: Value,
    breakaway_n_m: Value = 0.0,
    stribeck_speed: Value = 0.05,
    stribeck_exponent: Value = 2.0,
    load_n_m: Value = 0.0,
    load_coefficient: Value = 0.0,
    load_quadratic: Value = 0.0,
    positive_n_m: Value = 0.0,
    negative_n_m: Value = 0.0,
    free_speed: Tensor | None = None,
) -> Tensor:
    """The level of dry friction that sliding meets and that holds at rest, N m, shape (envs, joints).

    A ``breakaway_n_m`` above ``coulomb_n_m`` is a hump that ends at about ``stribeck_speed``, rad/s. ``load_n_m`` is
    the torque through the gears; of it ``load_coefficient`` and, per N m, ``load_quadratic`` are added. In motion of
    either sign ``positive_n_m`` or ``negative_n_m`` is too. The sign is that of ``free_speed``, with which the step
    would end without dry friction, or of ``speed``.
    """
    coulomb, width = _like(coulomb_n_m, speed), _like(stribeck_speed, speed)
    hump = torch.clamp(_like(breakaway_n_m, speed) - coulomb, min=0)
    ratio = speed.abs() / torch.where(width > 0, width, 1.0)
    share = torch.where(speed == 0, 1.0, torch.where(width > 0, torch.exp(-(ratio**stribeck_exponent)), 0.0))
    load = _like(load_n_m, speed)
    ways = _like(positive_n_m, speed), _like(negative_n_m, speed)
    sign = torch.sign(speed if free_speed is None else free_speed)
    way = 0.5 * (ways[0] + ways[1]) + 0.5 * sign * (ways[0] - ways[1])
    return coulomb + load_coefficient * load.abs() + load_quadratic * load**2 + hump * share + way


def bend(state: Tensor, displacement: Tensor, reach_rad: Value) -> Tensor:
    """A bristle's bend in -1 .. 1 after a displacement in rad, shape (envs, joints); a reach of 0 slides at once."""
    reach, sign = _like(reach_rad, state), torch.sign(displacement)
    rest = torch.where(reach > 0, torch.exp(-displacement.abs() / torch.where(reach > 0, reach, 1.0)), 0.0)
    return torch.where(displacement == 0, state, sign + (state - sign) * rest)


def spring_torque(
    angle: Tensor,
    stiffness: Value = 0.0,
    rest_rad: Value = 0.0,
    cubic: Value = 0.0,
    gravity_n_m: Value = 0.0,
    gravity_rest_rad: Value = 0.0,
    bias_n_m: Value = 0.0,
    cogging_n_m: Value = 0.0,
    cogging_periods: Value = 12.0,
    cogging_phase_rad: Value = 0.0,
    cogging_second_n_m: Value = 0.0,
    cogging_second_phase_rad: Value = 0.0,
) -> Tensor:
    """The torque of a cable, a hanging mass, a bias and cogging at an angle in rad: N m, shape (envs, joints).

    ``stiffness`` in N m/rad and ``cubic`` in N m/rad^3, from ``rest_rad`` on; ``cogging_periods`` a revolution, the
    second of them twice as many.
    Hysteresis of N m comes on top: - height * `bend`.
    """
    e = angle - rest_rad
    torque = bias_n_m - (stiffness + cubic * e**2) * e - gravity_n_m * torch.sin(angle - gravity_rest_rad)
    turn = cogging_periods * angle
    torque = torque + cogging_n_m * torch.sin(turn + cogging_phase_rad)
    return torque + cogging_second_n_m * torch.sin(2 * turn + cogging_second_phase_rad)


def stop_torque(angle: Tensor, stiffness: Value, stop_rad: Value, middle_rad: Value = 0.0) -> Tensor:
    """A soft stop's torque, N m, shape (envs, joints): above it where it lies above ``middle_rad``, else below."""
    beyond = angle - stop_rad
    above = _like(stop_rad, angle) >= middle_rad
    return -stiffness * torch.where(above, torch.clamp(beyond, min=0), torch.clamp(beyond, max=0))


@dataclass
class Drive:
    """A servo as gapscope.motor has it: its parameters, all neutral at their defaults, and its state.

    Its torque is ``gain`` command - ``kp`` angle - ``kd`` speed + ``bias_n_m``, before its stages; without ``gain``,
    kp. With `duty`, arguments of `duty_torque`, it is that of a servo by its duty cycle, whose supply sags too.
    Parameters are named as the plugin's and broadcast to (envs, joints); of limits 0 is none. Those of the command are
    in its unit, the others in N m, rad and s. As MuJoCo's actuators, the drive is ``gear`` away from the joint. Its
    command stays within ``command_low`` and ``command_high``, and what leaves it within ``force_limit_n_m``. Before
    that `friction`, arguments of `gear_friction`, is taken off. `max_delay_s` bounds both delays together. `spring` and
    `stop` are arguments of `spring_torque` and `stop_torque`, whose torques come on top. `step` is called once a time
    step, under an integrator that evaluates forces once (not RK4). The state is made by the first `step`; `reset` takes
    it from environments.
    """

    step_s: float
    kp: Value = 0.0
    kd: Value = 0.0
    gain: Value = None
    bias_n_m: Value = 0.0
    gear: Value = 1.0
    command_low: Value = -math.inf
    command_high: Value = math.inf
    max_delay_s: float = 0.0
    command_delay_s: Value = 0.0
    torque_delay_s: Value = 0.0
    command_time_constant_s: Value = 0.0
    command_dead_zone: Value = 0.0
    command_asymmetry: Value = 0.0
    time_constant_s: Value = 0.0
    second_time_constant_s: Value = 0.0
    dead_zone: Value = 0.0
    torque_limit_n_m: Value = 0.0
    limit_softness: Value = 0.0
    power_w: Value = 0.0
    generating_power_w: Value = 0.0
    peak_torque_n_m: Value = 0.0
    rated_speed_rad_per_s: Value = 0.0
    no_load_speed_rad_per_s: Value = 0.0
    generating_factor: Value = 1.0
    sag_fraction: Value = 0.0
    sag_time_constant_s: Value = 0.3
    droop_at_peak: Value = 0.0
    droop_reference_n_m: Value = 1.0
    droop_exponent: Value = 1.0
    asymmetry: Value = 0.0
    efficiency_drive: Value = 1.0
    efficiency_backdrive: Value = 1.0
    force_limit_n_m: Value = 0.0
    duty: dict[str, Value] | None = None
    friction: dict[str, Value] | None = None
    spring: dict[str, Value] | None = None
    stop: dict[str, Value] | None = None

    def __post_init__(self) -> None:
        for group in ("duty", "friction", "spring", "stop"):
            setattr(self, group, dict(getattr(self, group) or {}))
        self._fresh: Tensor = None  # of shape (envs,): the next step is the first one
        self._past: list[Tensor] = []  # commands, angles, speeds and feed-forward torques
        self._lags: dict[str, Tensor] = {}  # states, by the names of their time constants
        self._sag: Tensor = None

    def reset(self, envs: Any = slice(None)) -> None:
        """The next `step` is the first one of these environments (indices, a mask or a slice): all is at rest."""
        if self._fresh is not None:
            self._fresh[envs] = True

    def vary(self, name: str, values: Tensor, envs: Any, count: int) -> None:
        """Gives environments (indices, a mask or a slice) a number of their own, of ``count`` environments in all.

        ``values`` are of shape (environments,), in the unit of the parameter ``name``, the same for all joints. Before,
        it was one number for all, or varied so. "spring.stiffness" is that of `spring`.
        """
        group, _, key = name.rpartition(".")
        owner = getattr(self, group) if group else vars(self)
        of_all = torch.as_tensor(owner[key], dtype=values.dtype, device=values.device).expand(count, 1).clone()
        of_all[envs, 0] = values
        owner[key] = of_all

    def limit(self, torque: Tensor, speed: Tensor) -> Tensor:
        """The limit on a torque's size in its direction, before sag: N m, shape (envs, joints). ``speed``: rad/s."""
        power = torque * speed
        watts = torch.where(power > 0, _like(self.power_w, speed), _like(self.generating_power_w, speed))
        level, peak = _like(self.torque_limit_n_m, speed), _like(self.peak_torque_n_m, speed)
        curve = trapeze_limit(speed, peak, self.rated_speed_rad_per_s, self.no_load_speed_rad_per_s)
        curve = torch.where(power < 0, peak * self.generating_factor, curve)
        bounds = (
            torch.where(level > 0, level, math.inf),
            torch.where((watts > 0) & (power != 0), power_limit(speed, watts), math.inf),
            torch.where(peak > 0, curve, math.inf),
        )
        return torch.minimum(torch.minimum(bounds[0], bounds[1]), bounds[2])

    def step(self, target: Tensor, angle: Tensor, speed: Tensor, feed_forward: Tensor | None = None) -> Tensor:
        """The joint's torque in this step, N m, of shape (envs, joints): target and angle in rad, speed in rad/s.

        ``feed_forward``, N m, is added to what the servo wants, as late as the target and before the gear.
        """
        torque = self.gear * self._force(target, self.gear * angle, self.gear * speed, feed_forward)
        torque = torque + spring_torque(angle, **self.spring) if self.spring else torque
        return torque + stop_torque(angle, **self.stop) if self.stop else torque

    def _force(self, target: Tensor, angle: Tensor, speed: Tensor, feed_forward: Tensor | None) -> Tensor:
        """As `step`, of the drive alone: what it gives before its gear, by the motion that it sees."""
        target = torch.clamp(target, min=_like(self.command_low, target), max=_like(self.command_high, target))
        self._begin(target, angle, speed, torch.zeros_like(angle) if feed_forward is None else feed_forward)
        seen = self._seen(angle)
        request = self._request(seen, speed, 1.0)
        self._sag = torch.where(self._fresh[:, None], self._resting_sag(request, speed), self._sag)
        ceiling = 1 - self.sag_fraction * self._sag
        request = self._request(seen, speed, ceiling) if self.duty else request
        torque = self._lagged("second_time_constant_s", self._lagged("time_constant_s", request))
        self._fresh = torch.zeros_like(self._fresh)
        torque = dead_zone(torque, self.dead_zone)
        limit = self.limit(torque, speed)
        torque = soft_limit(torque, limit * ceiling, self.limit_softness)
        self._sag = lag_next(self._sag, self._load(torque, limit), self.sag_time_constant_s, self.step_s)
        torque = droop(torque, self.droop_at_peak, self.droop_reference_n_m, self.droop_exponent)
        torque = efficiency(
            by_direction(torque, self.asymmetry), speed, self.efficiency_drive, self.efficiency_backdrive
        )
        if self.friction:
            torque = torque - gear_friction(torque, speed, **self.friction)
        most = _like(self.force_limit_n_m, torque)
        return soft_limit(torque, torch.where(most > 0, most, math.inf), 0.0)

    def _begin(self, *now: Tensor) -> None:
        if self._fresh is None:
            steps = int(self.max_delay_s / self.step_s + 1e-9) + 2
            self._past = [values.expand(steps, *values.shape).clone() for values in now]
            self._sag = torch.zeros_like(now[0])
            self._fresh = torch.ones(len(now[0]), dtype=torch.bool, device=now[0].device)
        # Before the first step the command was what it is there, and the joint moved as fast.
        ago = self.step_s * torch.arange(len(self._past[0]), dtype=now[0].dtype, device=now[0].device)[:, None, None]
        for i, before in enumerate((now[0], now[1] - ago * now[2], now[2], now[3])):
            shifted = torch.cat([now[i][None], self._past[i][:-1]])
            self._past[i] = torch.where(self._fresh[None, :, None], before.expand_as(shifted), shifted)

    def _seen(self, angle: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """What the servo's computer has: a late command, angle and speed, and the feed-forward torque."""
        delay = _like(self.command_delay_s, angle) + self.torque_delay_s
        command = self._lagged("command_time_constant_s", late_command(self._past[0], delay, self.step_s))
        command = by_direction(dead_zone(command, self.command_dead_zone), self.command_asymmetry)
        motion = late_motion(self._past[1], self._past[2], self.torque_delay_s, self.step_s)
        return command, *motion, late_command(self._past[3], delay, self.step_s)

    def _request(self, seen: tuple[Tensor, ...], speed: Tensor, supply: Value) -> Tensor:
        """What the servo wants before its stages, by `_seen`; ``supply`` is the share of its volts that is left."""
        command, angle, seen_speed, beside = seen
        if self.duty:
            volts = {"supply_v": supply * self.duty["supply_v"]}
            return duty_torque(command - angle, seen_speed, speed, **{**self.duty, **volts}) + beside
        gain = self.kp if self.gain is None else self.gain
        return gain * command - self.kp * angle - self.kd * seen_speed + self.bias_n_m + beside

    def _lagged(self, name: str, request: Tensor) -> Tensor:
        """The lag's output in this step; its state goes on."""
        constant = getattr(self, name)
        state = torch.where(self._fresh[:, None], request, self._lags.get(name, request))
        self._lags[name] = lag_next(state, request, constant, self.step_s)
        return lag_output(state, request, constant, self.step_s)

    def _resting_sag(self, request: Tensor, speed: Tensor) -> Tensor:
        load = self._load(request, self.limit(request, speed))
        return torch.minimum(load, 1 / (1 + _like(self.sag_fraction, request)))

    def _load(self, torque: Tensor, limit: Tensor) -> Tensor:
        """The torque as a share of its limit, else of a duty's stall torque, 0 .. 1; 0 where there is neither."""
        stall = _like(0.0, torque)
        if self.duty:
            volts = self.duty.get("duty_limit", 1.0) * self.duty["supply_v"]
            stall = winding(volts, stall, self.duty["kt"], 0.0, self.duty["resistance"], self.duty.get("gear", 1.0))
        ceiling = torch.where(torch.isinf(limit), stall.abs(), limit)
        return torch.where(ceiling > 0, torch.clamp(torque.abs() / torch.where(ceiling > 0, ceiling, 1.0), max=1), 0.0)
