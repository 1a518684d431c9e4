"""What a user would take instead: other packages, each tuned as its documentation suggests.

Settings that a documentation leaves to its user are, of those that were tried, the ones that leave
least of the other half: no user can choose better.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tools.arena.signals import Fit, Half, Model

Array = NDArray[np.float64]

_SAMPLES: Final = 2
"""Of each signal in a network, the present one and the one before; with one it predicts worse."""


def sysidentpy_nfir(degree: int) -> Fit:
    """NFIR polynomial: FROLS chooses terms of three samples of each signal, BIC how many."""

    def fit(half: Half) -> Model:
        package = "sysidentpy"
        polynomial = import_module(f"{package}.basis_function").Polynomial(degree=degree)
        model = import_module(f"{package}.model_structure_selection").FROLS(
            order_selection=True,
            n_info_values=40,
            info_criteria="bic",
            xlag=[[1, 2, 3]] * half.columns.shape[1],
            model_type="NFIR",
            basis_function=polynomial,
            estimator=import_module(f"{package}.parameter_estimation").LeastSquares(),
        )
        scaled = _scaling(half.columns)

        def inputs(h: Half) -> Array:  # its shortest lag is one sample; the present one is wanted
            columns = scaled(h.columns)
            return np.concatenate([columns[1:], columns[-1:]])

        model.fit(X=inputs(half), y=half.effort[:, None])
        return lambda h: np.asarray(model.predict(X=inputs(h), y=h.effort[:, None])[:, 0])

    return fit


def pysindy_inverse(half: Half) -> Model:
    """STLSQ over polynomials of degree 2, threshold 0.005, with the effort as its target."""
    pysindy = import_module("pysindy")
    scaled, scale = _scaling(half.columns), float(np.std(half.effort))
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=0.005, alpha=1e-6),
        feature_library=pysindy.PolynomialLibrary(degree=2),
    )
    step_s = float(half.time_s[1] - half.time_s[0])
    target = half.effort[half.scored, None] / scale
    model.fit(scaled(half.columns)[half.scored], t=step_s, x_dot=target)
    return lambda other: scale * np.asarray(model.predict(scaled(other.columns)))[:, 0]


def jax_sysid_network(half: Half) -> Model:
    """Two layers of 20 by L-BFGS, as its README has them; two samples of each signal."""
    nn, models = import_module("flax.linen"), import_module("jax_sysid.models")
    columns, scale = _with_past(half.columns, _SAMPLES), float(np.std(half.effort))
    scaled = _scaling(columns)
    layers = [nn.Dense(20), nn.tanh, nn.Dense(20), nn.tanh, nn.Dense(1)]
    model = models.FNN(1, columns.shape[1], lambda: nn.Sequential(layers))
    model.loss(rho_th=1e-5, tau_th=0.0)
    model.optimization(adam_epochs=0, lbfgs_epochs=1000, iprint=-1)
    model.fit(half.effort[half.scored, None] / scale, scaled(columns)[half.scored])

    def predicted(other: Half) -> Array:
        return scale * np.asarray(model.predict(scaled(_with_past(other.columns, _SAMPLES))))[:, 0]

    return predicted


def _with_past(columns: Array, samples: int) -> Array:
    """Signals (n, m) with so many samples of each, the present one and those before."""
    return np.column_stack([np.roll(columns, k, axis=0) for k in range(samples)])


def _scaling(columns: Array) -> Callable[[Array], Array]:
    """To a mean of zero and a deviation of one, as these columns have it then."""
    mean, std = np.mean(columns, axis=0), np.std(columns, axis=0)
    return lambda other: np.asarray((other - mean) / std)


_DRIVE: Final = """
<mujoco>
  <option timestep="{step_s}" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
    <body name="carriage">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <joint name="slide" type="slide" axis="1 0 0"/>
    </body>
  </worldbody>
  <actuator><motor name="force" joint="slide"/><motor name="offset" joint="slide"/></actuator>
  <sensor>
    <jointpos name="position" joint="slide"/><jointvel name="velocity" joint="slide"/>
  </sensor>
</mujoco>
"""
_WINDOW_S: Final = 2.0
"""Of a rollout from a recorded state; after 0.25, 0.5 and 1 s, what is fitted predicts worse."""


def mujoco_sysid(half: Half) -> Model:
    """A slide with mass, damping, frictionloss and constant force; rollouts of 2 s."""
    mujoco, sysid = import_module("mujoco"), import_module("mujoco.sysid")
    spec = mujoco.MjSpec.from_string(_DRIVE.format(step_s=half.period_s))
    rollouts = _rollouts(sysid, spec, half, round(_WINDOW_S / half.period_s))
    columns = np.column_stack([half.columns[:, 1:], np.ones(len(half.effort))])
    damping, mass, friction, _ = np.linalg.lstsq(columns, half.effort)[0]
    found, _ = sysid.optimize(
        initial_params=_parameters(sysid, float(mass), float(damping), float(friction)),
        residual_fn=sysid.build_residual_fn(models_sequences=[rollouts], n_threads=1),
        optimizer="mujoco",
        verbose=False,
    )
    mass, damping, friction, push = (float(p.value[0]) for p in found.values())
    return lambda o: mass * o.acceleration + damping * o.velocity + friction * o.direction - push


def _rollouts(sysid: Any, spec: Any, half: Half, samples: int) -> Any:
    """Stretches of so many samples, each from its own recorded state."""
    model, grid = spec.compile(), half.grid
    time_s = half.period_s * np.arange(samples)
    states, controls, sensors = [], [], []
    for first in range(0, len(grid.effort) - samples, samples):
        rows = slice(first, first + samples)
        position, velocity = grid.position[rows], grid.velocity[rows]
        states.append(sysid.create_initial_state(model, position[:1], velocity[:1], np.zeros(0)))
        force = np.column_stack([grid.effort[rows], np.ones(samples)])
        controls.append(sysid.TimeSeries(time_s, force))
        seen = np.column_stack([position, velocity])
        sensors.append(sysid.TimeSeries.from_names(time_s, seen, model))
    names = [f"stretch {number}" for number in range(len(states))]
    return sysid.ModelSequences("drive", spec, names, states, controls, sensors)


def _parameters(sysid: Any, mass: float, damping: float, friction: float) -> Any:
    """What is fitted, from the base model's values on, within a fifth and five times them."""

    def set_damping(spec: Any, parameter: Any) -> None:
        spec.joint("slide").damping[0] = parameter.value[0]  # of a polynomial: the linear one

    setters: dict[str, tuple[float, Callable[[Any, Any], None]]] = {
        "mass": (mass, lambda s, p: setattr(s.body("carriage"), "mass", p.value[0])),
        "damping": (damping, set_damping),
        "friction": (friction, lambda s, p: setattr(s.joint("slide"), "frictionloss", p.value[0])),
    }
    parameters = sysid.ParameterDict()
    for name, (start, setter) in setters.items():
        low, high = 0.2 * start, 5.0 * start
        parameters.add(sysid.Parameter(name, start, low, high, modifier=setter))

    def push(spec: Any, parameter: Any) -> None:
        spec.actuator("offset").gainprm[0] = parameter.value[0]

    parameters.add(sysid.Parameter("offset", 0.0, -friction, friction, modifier=push))
    return parameters
