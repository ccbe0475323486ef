"""Data as users of pandas hold them."""
import numpy as np
import pytest

import whirl

pd = pytest.importorskip("pandas")
T = np.arange(0, 20, 0.01)


def oscillator(w2=2.0, c=0.1, x0=1.0):
    """Closed form of x'' = -w2 x - c x', x'(0) = 0."""
    wd = np.sqrt(w2 - c * c / 4)
    decay = x0 * np.exp(-c / 2 * T)
    return pd.DataFrame({"x": decay * (np.cos(wd * T) + c / (2 * wd) * np.sin(wd * T)), "v": -decay * w2 / wd * np.sin(wd * T)}, index=T)


def test_columns_name_the_variables():
    frame = oscillator()
    model = whirl.SINDy().fit(frame, t=T)
    assert model.equations() == ["1.000 v", "-2.000 x + -0.100 v"]
    assert list(model.feature_names_in_) == ["x", "v"]
    np.testing.assert_array_equal(model.predict(frame), whirl.SINDy().fit(frame.to_numpy(), t=T).predict(frame.to_numpy()))
    with pytest.raises(ValueError, match="same order"):
        model.predict(frame[["v", "x"]])
    with pytest.raises(ValueError, match="unseen"):
        model.score(frame.rename(columns={"v": "w"}), t=T)
    # Words that cannot stand in a formula are no names of variables.
    assert whirl.SINDy().fit(frame.set_axis(["x in mm", "t"], axis=1), t=T).equations()[0] == "1.000 x1"


def test_coefficients_as_a_frame():
    table = whirl.SINDy().fit(oscillator(), t=T).to_pandas()
    assert list(table.columns) == ["x'", "v'"] and table.index.name == "term"
    assert table.loc["x", "v'"] == pytest.approx(-2, rel=1e-3) and table.loc["v", "x'"] == pytest.approx(1, rel=1e-3)


def test_lists_of_frames_and_of_inputs():
    frames = [oscillator(), oscillator(x0=0.4)]
    assert whirl.SINDy().fit(frames, t=T).equations()[1] == "-2.000 x + -0.100 v"
    with pytest.raises(ValueError, match="must be the same"):
        whirl.SINDy().fit([frames[0], frames[1].rename(columns={"v": "w"})], t=T)
    force = pd.DataFrame({"f": np.zeros(len(T))})
    assert whirl.SINDy().fit(frames[0], t=T, u=force).feature_names_ == ["x", "v", "f"]


def test_dates_are_no_nanoseconds():
    frame = oscillator()
    dates = pd.Timestamp("2026-03-01") + pd.to_timedelta(T, unit="s")
    for times in (dates, dates - dates[0], pd.Series(dates)):
        assert whirl.SINDy().fit(frame, t=times).equations()[1] == "-2.000 x + -0.100 v"
    assert whirl.Recording({"x": frame["x"]}, t=dates).dt == pytest.approx(0.01, rel=1e-9)
    assert whirl.Recording({"x": frame["x"]}, t=dates - dates[0]).t0 == 0
    with pytest.raises(whirl.Error, match="datetime64"):
        whirl.Recording({"x": dates}, dt=0.01)


def test_a_frame_named_like_a_csv_file_is_a_record():
    record = whirl.VirtualRig({"rotor.added_mass_g": 5}).record(seed=1)
    frame = pd.DataFrame({"x_mm": 1e3 * record["x"], "y_mm": 1e3 * record["y"], "beta_deg": np.degrees(record["beta"])},
                         index=pd.Index(record.t, name="t_s"))
    for same in (whirl.read(frame), whirl.read(frame.reset_index()), whirl.read(frame.reset_index(drop=True), rate=1 / record.dt)):
        assert same.dt == pytest.approx(record.dt)
        np.testing.assert_allclose(same["x"], record["x"], rtol=1e-12, atol=1e-18)
        np.testing.assert_allclose(same["beta"], record["beta"], rtol=1e-12)
    with pytest.raises(TypeError, match="whirl.read"):
        whirl.identify(frame)
