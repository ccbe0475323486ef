"""Figures of results with matplotlib, where it is installed. Each takes the axes to draw on and returns them."""
import numpy as np


def _axes(axes, rows=1):
    if axes is not None:
        return axes
    from matplotlib import pyplot

    return pyplot.subplots(rows, 1, sharex=True, squeeze=False, layout="constrained")[1][:, 0]


def recording(record, channels=None, axes=None):
    """One panel per channel over time (SI units)."""
    names = list(channels or record.names)
    axes = np.atleast_1d(_axes(axes, len(names)))
    for axis, name in zip(axes, names):
        axis.plot(record.t, record[name], linewidth=0.8)
        axis.set_ylabel(f"{name} [{record.units[name]}]")
    axes[-1].set_xlabel("time [s]")
    return axes


def frequency_response(frf, axes=None):
    """Magnitude and phase of every channel."""
    axes = np.atleast_1d(_axes(axes, 2))
    for (response, reference), column in zip(frf.names, frf.values.T):
        axes[0].semilogy(frf.frequency, np.abs(column), linewidth=0.8, label=f"{response} / {reference}")
        axes[1].plot(frf.frequency, np.degrees(np.angle(column)), linewidth=0.8)
    axes[0].set_ylabel(f"{frf.kind} [SI]")
    axes[0].legend()
    axes[1].set_ylabel("phase [deg]")
    axes[1].set_xlabel("frequency [Hz]")
    return axes


def run(closed_loop, axes=None):
    """Displacement of the disk centre without and with control, and the force."""
    log = closed_loop.log
    axes = np.atleast_1d(_axes(axes, 2))
    axes[0].plot(log.t, 1e3 * log["x_open"], color="0.6", linewidth=0.8, label="without control")
    axes[0].plot(log.t, 1e3 * log["x_true"], linewidth=0.8, label="with control")
    axes[0].set_ylabel("x [mm]")
    axes[0].legend()
    axes[1].plot(log.t, log["ux"], linewidth=0.8)
    axes[1].set_ylabel("force x [N]")
    axes[1].set_xlabel("time [s]")
    return axes


def steady_response(found, axes=None):
    """Amplitude and phase over speed; unstable answers dashed."""
    axes = np.atleast_1d(_axes(axes, 2))
    speed, stable = found.speed * 30 / np.pi, found.stable
    for axis, values in zip(axes, (found.amplitude, np.degrees(np.unwrap(found.phase)))):
        axis.plot(speed, np.where(stable, values, np.nan), linewidth=1.2, label="stable")
        if not stable.all():
            axis.plot(speed, np.where(stable, np.nan, values), "--", linewidth=0.8, label="unstable")
    for kind, at, height in found.events:
        axes[0].plot(at * 30 / np.pi, height, "o", color="0.3", markersize=4)
    axes[0].set_ylabel("amplitude, peak [SI]")
    axes[0].legend()
    axes[1].set_ylabel("phase [deg]")
    axes[-1].set_xlabel("speed [rpm]")
    return axes


def modes(found, axes=None):
    """Damping ratio over frequency with two standard deviations of both."""
    axes = np.atleast_1d(_axes(axes))
    (f, f_sd), (d, d_sd) = (np.array([(getattr(mode, part).value, getattr(mode, part).sd) for mode in found], float).T
                            for part in ("frequency", "damping"))
    axes[0].errorbar(f, 100 * d, xerr=2 * f_sd, yerr=200 * d_sd, fmt="o", markersize=4, linewidth=0.8)
    axes[0].set_xlabel("frequency [Hz]")
    axes[0].set_ylabel("damping ratio [%]")
    return axes


def parameters(found, axes=None):
    """Each parameter's 95 % interval in percent of its value; parameters of value 0 are left out."""
    axes = np.atleast_1d(_axes(axes))
    model = getattr(found, "model", found)
    shown = {name: e for name, e in model.parameters.items() if e.value and np.isfinite([e.low, e.high]).all()}
    low, high = ([100 * abs(getattr(e, side) - e.value) / abs(e.value) for e in shown.values()] for side in ("low", "high"))
    axes[0].errorbar(np.zeros(len(shown)), np.arange(len(shown)), xerr=[low, high], fmt="o", markersize=3, capsize=3, linewidth=1)
    axes[0].set_yticks(range(len(shown)), labels=[f"{name} = {e.value:.4g}" for name, e in shown.items()])
    axes[0].invert_yaxis()
    axes[0].set_xlabel("95 % interval, percent of the value")
    return axes
