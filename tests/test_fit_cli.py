"""bodyplan fit as a user meets it: curves by name, points and table; the numbers of bp.fit; files; refusals."""

import html
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.missions.curve_input import READY, load_curve
from bodyplan.show.fit_outcome import FitOutcome, axes_of
from bodyplan.show.fit_page import fit_page
from bodyplan.show.fitted_plots import angles as angles_plot
from bodyplan.show.fitted_plots import overlay

FIT_FILES = {"fit.html", "fit.png", "fit.svg", "angles.csv", "fit.json"}


def bodyplan(*arguments):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def serpenoid(tmp_path_factory):
    """The paper's serpenoid by ten arcs, into a folder."""
    out = tmp_path_factory.mktemp("fit") / "fit-serpenoid"
    return bodyplan("fit", "serpenoid", "--joints", "10", "--joint", "arc", "--out", str(out)), out


def helix_points(count=60):
    """Points (count, 3) of a helix of radius 0.1 m and rise 0.05 m a radian."""
    t = np.linspace(0.0, 5.0, count)
    return np.stack([0.1 * np.sin(t), 0.1 * (1.0 - np.cos(t)), 0.05 * t], axis=1)


# --- what it prints and writes


def test_the_folder_and_the_screen_hold_the_numbers_of_bp_fit(serpenoid):
    result, out = serpenoid
    assert result.exit_code == 0, result.output
    assert {p.name for p in out.iterdir()} == FIT_FILES
    assert not [p for p in out.parent.iterdir() if p.name.startswith(".")]
    robot = bp.snake(10, 0.1, joint="arc")
    fit = bp.fit(bp.Serpenoid(np.pi / 3), robot)
    found = json.loads((out / "fit.json").read_text())
    assert found["error"] == pytest.approx(fit.error, rel=1e-9)
    assert found["max_distance_m"] == pytest.approx(fit.max_distance, rel=1e-9)
    assert list(found["angles_rad"]) == list(robot.joints)
    np.testing.assert_allclose(list(found["angles_rad"].values()), np.asarray(fit.q), atol=1e-14)
    assert f"E_nm       {fit.error:.6e}" in result.output
    for name, angle in zip(robot.joints, np.degrees(np.asarray(fit.q)), strict=True):
        assert re.search(rf"\b{name} +{angle:.6f}\n", result.output)
    assert str(out / "fit.html") in result.output


def test_mechanisms_stand_side_by_side_with_the_known_errors(serpenoid):
    """Errors of the rules on the paper's serpenoid, alpha = pi/3, n = 10, p at the Gauss node, R_s = 0.18."""
    rows = {(r["mechanism"], r["rule"]): r for r in json.loads((serpenoid[1] / "fit.json").read_text())["mechanisms"]}
    known = {"arc": 1.6522e-4, "double": 8.0663e-4, "straight": 2.1641e-3}
    for mechanism, error in known.items():
        assert rows[mechanism, "paper"]["error"] == pytest.approx(error, rel=1e-4)
        assert rows[mechanism, "optimal"]["error"] <= rows[mechanism, "paper"]["error"]
    assert rows["arc", "optimal"]["error"] / rows["arc", "paper"]["error"] == pytest.approx(0.927, abs=0.02)
    assert [k for k, r in rows.items() if r["mine"]] == [("arc", "paper")]


def test_the_angles_are_a_table_for_motors(serpenoid):
    lines = (serpenoid[1] / "angles.csv").read_text().splitlines()
    assert lines[0] == "joint,angle [rad],angle [deg]" and len(lines) == 11
    name, rad, deg = lines[3].split(",")
    assert name == "yaw3" and float(deg) == pytest.approx(np.degrees(float(rad)), rel=1e-12)


def test_options_reach_the_fit(tmp_path):
    out = tmp_path / "f"
    arguments = ["--joints", "7", "--joint", "double", "--end-link", "0.16", "--p", "0.789", "--start", "100 mm"]
    arguments += ["--set", "alpha=40 deg", "--set", "wavelength=500 mm", "--axes", "universal", "--out", str(out)]
    assert bodyplan("fit", "serpenoid", *arguments).exit_code == 0
    robot = bp.snake(7, 1.0 / 7.0, joint="double", axes="universal", end_link=0.16)
    fit = bp.fit(bp.Serpenoid(np.radians(40.0), 0.5), robot, p=0.789, start=0.1)
    found = json.loads((out / "fit.json").read_text())
    assert found["error"] == pytest.approx(fit.error, rel=1e-9) and found["p"] == 0.789
    assert (found["joint"], found["joints"], found["axes"]) == ("double", 7, "universal")


@pytest.mark.parametrize("name", [*READY, "sinus_lift", "sinus-lifting", "SERPENOID"])
def test_curves_by_name_are_the_papers(name):
    _, curve = load_curve(name)
    expected = {
        "serpenoid": bp.Serpenoid(np.pi / 3),
        "spiral": bp.Spiral(12.0, 3.6),
        "sinus": bp.SinusLift(5 * np.pi / 12, 0.3),
    }
    kind = "sinus" if "sinus" in name else name.lower()
    s = np.linspace(0.0, 1.0, 17)
    np.testing.assert_allclose(curve.shape(s), expected[kind].shape(s), rtol=1e-12, atol=1e-12)


def test_curves_from_points(tmp_path):
    points = helix_points()
    np.save(tmp_path / "helix.npy", points)
    np.savetxt(tmp_path / "helix.csv", points, delimiter=",", header="x,y,z", comments="")
    curves = [load_curve(str(tmp_path / f"helix.{suffix}"))[1] for suffix in ("npy", "csv")]
    for curve in curves:
        np.testing.assert_allclose(curve.frames(curve.stations)[0], points, atol=1e-9)
    result = bodyplan("fit", str(tmp_path / "helix.csv"), "--out", str(tmp_path / "h.svg"))
    assert result.exit_code == 0, result.output
    # 5 rad of a helix with radius .1 and rise .05 a radian
    assert f"length {5.0 * np.hypot(0.1, 0.05):.3g}" in result.output and "axes universal" in result.output


def test_curves_from_tables(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('[curve]\nkind = "serpenoid"\nalpha = "50 deg"\nlength = "0.7 m"\n')
    assert load_curve(str(path)) == ("mine", bp.Serpenoid(np.radians(50.0), length=0.7))
    assert load_curve(str(path), ["alpha=0.5"])[1] == bp.Serpenoid(0.5, length=0.7)
    path.write_text('title = "x"\n[gait]\nkind = "serpentine"\n[gait.curve]\nkind = "spiral"\n')
    assert load_curve(str(path))[1] == bp.Spiral()
    path.write_text('kind = "spiral"\ncurvature = 3.0\n')
    assert load_curve(str(path))[1] == bp.Spiral(3.0)


def test_axes_follow_from_the_curve():
    assert axes_of(bp.Serpenoid(1.0)) == "yaw"
    assert axes_of(bp.Serpenoid(1.0, plane="pitch")) == "pitch"
    assert axes_of(bp.Spiral()) == "universal"
    straight = FitOutcome.of("s", bp.Spiral(), joints=5, joint="straight")
    # paper acm compares n arcs with 2 n links that turn about one axis each
    assert straight.axes == "alternating" and straight.fit.robot.n == 9


@pytest.mark.parametrize("suffix", ["html", "png", "svg", "pdf"])
def test_one_file_where_one_is_asked_for(tmp_path, suffix):
    path = tmp_path / f"fit.{suffix}"
    arguments = ["fit", "sinus-lift", "--joints", "4", "--out", str(path)]
    result = bodyplan(*arguments)
    assert result.exit_code == 0, result.output
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    content = path.read_bytes()
    if suffix == "svg":
        assert ElementTree.fromstring(content).tag.endswith("svg")
    else:
        assert content.startswith({"html": b"<!doctype html>", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix])
    again = bodyplan(*arguments)
    assert again.exit_code == 2 and "--force" in again.output and path.read_bytes() == content
    assert bodyplan(*arguments, "--force").exit_code == 0


def test_the_default_place_is_under_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert bodyplan("fit", "serpenoid", "--joints", "3").exit_code == 0
    assert {p.name for p in (tmp_path / "runs" / "fit-serpenoid").iterdir()} == FIT_FILES


def test_the_page_says_the_numbers_and_loads_nothing(serpenoid):
    text = (serpenoid[1] / "fit.html").read_text(encoding="utf-8")
    fit = bp.fit(bp.Serpenoid(np.pi / 3), bp.snake(10, 0.1, joint="arc"))
    assert f"{fit.error:.5g}" in text and f"{1e3 * fit.max_distance:.4g}\u00a0mm" in text
    data = json.loads(re.search(r'id="plots-data">(.*?)</script>', text, re.S)[1])
    assert set(data) == {"overlay", "turning", "distance", "angles"}
    # Fig. 7(c): the polyline of arcs ends where all its angles and the virtual joint are summed
    line = next(t for t in data["turning"]["data"] if t["name"] == "mechanism")
    assert line["y"][-1] == pytest.approx(np.asarray(fit.q).sum() + fit.kink[1], abs=1e-4)
    assert max(data["distance"]["data"][0]["y"]) == pytest.approx(1e3 * fit.max_distance, rel=1e-2)
    own = re.sub(r"<script>.*?</script>", "", text, flags=re.S)
    assert "default-src 'none'" in own and not re.search(r'(src|href)="(?!#)', own)


def test_several_panels_name_their_axes_where_neighbours_leave_room():
    """On a narrow screen a title beside the second panel would stand in the first."""
    layout = overlay(FitOutcome.of("sinus-lift", load_curve("sinus-lift")[1], joints=5).drawn)["layout"]
    names = [layout[f"xaxis{i}"]["title"]["text"] for i in ("", "2", "3")]
    assert names == ["y over x (m)<br>from above", "z over x (m)<br>from the side", "z over y (m)<br>from the front"]
    assert [key for key in ("yaxis", "yaxis2", "yaxis3") if "title" in layout[key]] == []
    alone = overlay(FitOutcome.of("serpenoid", load_curve("serpenoid")[1], joints=5).drawn)["layout"]
    assert (alone["xaxis"]["title"]["text"], alone["yaxis"]["title"]["text"]) == ("x (m)", "y (m)")


def test_a_staircase_has_both_sides_of_every_step():
    outcome = FitOutcome.of("s", bp.Serpenoid(1.0), joints=5, joint="straight")
    drawn = outcome.drawn
    (turning,) = drawn.turnings
    steps = np.diff(turning.mechanism)
    big = np.flatnonzero(np.abs(steps) > 1e-6)
    np.testing.assert_allclose(drawn.s[big + 1], [0.2, 0.4, 0.6, 0.8], atol=1e-12)
    np.testing.assert_allclose(steps[big], np.asarray(outcome.fit.q), atol=1e-12)
    assert np.all(np.diff(drawn.s)[big] < 1e-8)


def test_texts_of_a_curve_stay_texts():
    outcome = FitOutcome.of("<script>x</script>", bp.Serpenoid(1.0), joints=3)
    assert "<script>x" not in fit_page(outcome) and "&lt;script&gt;x" in fit_page(outcome)


def test_convergence_has_its_table_figure_and_orders(tmp_path):
    pytest.importorskip("bodyplan.fitting.convergence")
    out = tmp_path / "c"
    result = bodyplan("fit", "serpenoid", "--joints", "5", "--convergence", "--out", str(out))
    assert result.exit_code == 0, result.output
    rows = json.loads((out / "fit.json").read_text())["convergence"]["rows"]
    arc = {r["joints"]: r["error"] for r in rows if (r["mechanism"], r["rule"]) == ("arc", "paper")}
    straight = {r["joints"]: r["error"] for r in rows if (r["mechanism"], r["rule"]) == ("straight", "paper")}
    assert arc[10] == pytest.approx(1.6522e-4, rel=1e-4) and arc[5] == pytest.approx(2.1874e-3, rel=1e-4)
    assert np.log2(arc[20] / arc[40]) == pytest.approx(3.0, abs=0.1)
    assert np.log2(straight[20] / straight[40]) == pytest.approx(2.0, abs=0.1)
    text = (out / "fit.html").read_text(encoding="utf-8")
    assert '"convergence"' in text and "Over the number of joints" in text
    assert "arc" in result.output and "order" in result.output


def shown(out):
    """The page as one reads it: without scripts, tags as spaces."""
    text = re.sub(r"<script.*?</script>", "", (out / "fit.html").read_text("utf-8"), flags=re.S)
    return html.unescape(re.sub(r"<[^>]*>", " ", text))


def test_axes_that_the_robot_lacks_are_warned_of(tmp_path):
    """A spiral bends about both axes by its curvature, in the frame that does not roll."""
    result = bodyplan("fit", "spiral", "--axes", "yaw", "--joints", "5", "--out", str(tmp_path / "f"))
    assert result.exit_code == 0
    (bend,) = re.findall(
        r"  warning    the curve bends about pitch \(by up to (\S+) rad/m\), but the robot", result.output
    )
    assert float(bend) == pytest.approx(12.0, rel=5e-3)
    assert "Warning: the curve bends about pitch (by up to" in shown(tmp_path / "f")
    found = json.loads((tmp_path / "f" / "fit.json").read_text())
    assert found["status"] == "ok" and len(found["warnings"]) == 1
    wave = FitOutcome.of("s", bp.Serpenoid(np.pi / 3), joints=3, axes="pitch")
    # the steepest place of theta = alpha cos(2 pi s): eq. (1) of paper acm has kappa_y there
    assert wave.warnings == ("the curve bends about yaw (by up to 6.58 rad/m), but the robot has no joints that do",)
    assert FitOutcome.of("s", bp.Serpenoid(1.0), joints=3, axes="yaw").warnings == ()
    assert FitOutcome.of("s", bp.Serpenoid(0.0), joints=3, axes="pitch").warnings == ()
    assert FitOutcome.of("s", bp.Spiral(), joints=3).warnings == ()


def test_a_gain_against_a_rule_beyond_the_limits_says_so(tmp_path):
    arguments = ["--method", "optimal", "--joints", "5", "--limit"]
    words = "the rule's angles are beyond the limits"
    tight = bodyplan("fit", "serpenoid", *arguments, "20 deg", "--out", str(tmp_path / "f"))
    assert tight.exit_code == 0
    (gain, said) = re.search(r"  gain       (\S+) of the error of the paper's rule(.*)", tight.output).groups()
    assert float(gain) > 1.0 and said == f"; {words}"
    assert words.replace("'", "’") in shown(tmp_path / "f")
    wide = bodyplan("fit", "serpenoid", *arguments, "80 deg", "--out", str(tmp_path / "g"))
    assert float(re.search(r"gain       (\S+) of", wide.output)[1]) < 1.0 and "beyond" not in wide.output
    assert "beyond the limits" not in shown(tmp_path / "g")


def test_straight_links_have_one_joint_less(tmp_path):
    result = bodyplan("fit", "serpenoid", "--joint", "straight", "--out", str(tmp_path / "f"))
    assert "serpenoid by 10 straight links with 9 joints" in result.output
    text = shown(tmp_path / "f").replace("\u00a0", " ")
    assert "A mechanism of 10 straight links with 9 joints (yaw)" in text and "10 joints" not in text
    turns = FitOutcome.of("s", bp.Spiral(), joints=5, joint="straight")
    assert turns.mechanism == "10 straight links with 9 joints" and turns.fit.robot.n == 9
    assert FitOutcome.of("s", bp.Spiral(), joints=1).title == "s by 1 arc-shaped joint"


def test_rounding_is_no_angle(tmp_path):
    """A serpenoid turns about yaw alone: pitch angles are 0 and shown so."""
    result = bodyplan("fit", "serpenoid", "--axes", "universal", "--joints", "4", "--out", str(tmp_path / "f"))
    assert re.search(r"pitch2 +0\.000000\n", result.output) and "-0.000000" not in result.output
    text = shown(tmp_path / "f")
    assert "×10" not in text[text.index("virtual joint at the tail") : text.index("Beside other mechanisms")]
    names = ["yaw1", "pitch1", "yaw2"]
    made = angles_plot(names, np.array([0.5, -4e-16, 1e-10]), np.full((3, 2), np.inf))
    assert {x: y for trace in made["data"] for x, y in zip(trace["x"], trace["y"], strict=True)} == {
        "yaw1": pytest.approx(28.6479, rel=1e-5),
        "pitch1": 0.0,
        "yaw2": pytest.approx(np.degrees(1e-10), rel=1e-5),
    }
    # joints in the order of the body, as in the PNG
    assert made["layout"]["xaxis"]["categoryarray"] == names


def test_mechanisms_that_cannot_be_made_say_why(tmp_path):
    result = bodyplan("fit", "serpenoid", "--joints", "1", "--out", str(tmp_path / "f"))
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "f" / "fit.json").read_text())["mechanisms"]
    assert [r["mechanism"] for r in rows] == ["straight", "straight", "arc", "arc", "double", "double"]
    for row in rows:
        assert (row["status"] == "refused") == (row["mechanism"] == "straight") == (row["error"] is None)
    assert rows[0]["reason"] and f"straight cannot be made: {rows[0]['reason']}" in result.output
    assert f"refused: {rows[0]['reason']}" in shown(tmp_path / "f")


# --- what is refused or fails


def test_joints_beyond_their_limits_fail_with_their_names(tmp_path):
    result = bodyplan("fit", "serpenoid", "--limit", "35 deg", "--out", str(tmp_path / "f"))
    assert result.exit_code == 1 and "limit: joint 'yaw3' would be at 0.66877 rad" in result.output
    # at n = 10 two joints bend by 38.32 deg, the others by less than 32
    assert "yaw3 (by 3.32" in result.output and "yaw8 (by 3.32" in result.output and "yaw2 (" not in result.output
    within = bodyplan("fit", "serpenoid", "--limit", "35 deg", "--method", "optimal", "--out", str(tmp_path / "g"))
    assert within.exit_code == 0 and "at or beyond: yaw3, yaw8" in within.output


def test_a_curve_that_ends_is_a_status(tmp_path):
    np.save(tmp_path / "p.npy", helix_points())
    result = bodyplan("fit", str(tmp_path / "p.npy"), "--start", "50 mm", "--out", str(tmp_path / "f"))
    assert result.exit_code == 1 and re.search(
        r"curve_ended: the robot takes 0\.05 \.\. \S+ m of a curve", result.output
    )


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["serpenoit"], ["serpenoit", "Did you mean 'serpenoid'", "sinus-lift", "spiral", ".csv"]),
        (["none.csv"], ["none.csv", "no such file"]),
        (["serpenoid", "--joint", "arcs"], ["arcs", "arc", "double", "straight"]),
        (["serpenoid", "--method", "best"], ["best", "optimal", "paper"]),
        (["serpenoid", "--axes", "roll"], ["roll", "alternating", "universal", "yaw"]),
        (["serpenoid", "--joints", "0"], ["joints", "0"]),
        (["serpenoid", "--joints", "100000"], ["joints", "100000"]),
        (["serpenoid", "--joints", "1", "--joint", "straight"], ["joint"]),
        (["serpenoid", "--p", "0.5"], ["p", "0.5"]),
        (["serpenoid", "--p", "nan"], ["p"]),
        (["serpenoid", "--end-link", "0.5", "--joint", "double"], ["end_link", "0.5"]),
        (["serpenoid", "--end-link", "0.5", "--joint", "arc"], ["end_link", "0.5"]),
        (["serpenoid", "--end-link", "0", "--joint", "straight"], ["end_link", "0"]),
        (["serpenoid", "--limit", "-1 deg"], ["limit"]),
        (["serpenoid", "--limit", "1 kg"], ["limit", "1 kg"]),
        (["serpenoid", "--limit", "75"], ["limit: must be at most half a turn", "75 rad", "75 deg"]),
        (["serpenoid", "--start", "1e300"], ["start: too far"]),
        (["serpenoid", "--set", "alpha=1e8"], ["more than", "bends too much"]),
        (["serpenoid", "--start", "1 s"], ["start", "1 s", "length"]),
        (["serpenoid", "--start", "inf"], ["start"]),
        (["serpenoid", "--set", "alfa=1"], ["alfa", "alpha", "wavelength"]),
        (["serpenoid", "--set", "alpha=1 kg"], ["alpha", "1 kg"]),
        (["serpenoid", "--set", "length=-1"], ["length", "-1"]),
        (["serpenoid", "--set", "alpha"], ["--set alpha", "field=value"]),
        (["serpenoid", "--out", "fit.jpeg"], ["fit.jpeg", ".png"]),
        (["serpenoid", "--out", "nowhere/fit.html"], ["nowhere"]),
    ],
)
def test_mistakes_end_with_two_and_one_message(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = bodyplan("fit", *arguments)
    assert result.exit_code == 2 and "Traceback" not in result.output, result.output
    assert [w for w in words if w not in result.output] == []
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text,words",
    [
        ("[curve\n", ["not valid TOML"]),
        ("[curve]\nalpha = 1\n", ["kind", "[curve]"]),
        ('[curve]\nkind = "serpent"\n', ["serpent", "serpenoid"]),
        ('[curve]\nkind = "serpenoid"\n', ["alpha"]),
    ],
)
def test_bad_tables_are_named(text, words, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(bp.InputError) as caught:
        load_curve(str(path))
    assert "mine.toml" in str(caught.value) and [w for w in words if w not in str(caught.value)] == []


def test_points_have_nothing_to_set(tmp_path):
    np.save(tmp_path / "p.npy", helix_points())
    with pytest.raises(bp.InputError, match="--set length=2"):
        load_curve(str(tmp_path / "p.npy"), ["length=2"])


def test_files_beside_a_fit_are_kept(serpenoid):
    _, out = serpenoid
    refused = bodyplan("fit", "serpenoid", "--out", str(out))
    assert refused.exit_code == 2 and "--force" in refused.output
    note = out / "notes.txt"
    note.write_text("precious")
    refused = bodyplan("fit", "serpenoid", "--out", str(out), "--force")
    note.unlink()
    assert refused.exit_code == 2 and "notes.txt" in refused.output and (out / "fit.html").exists()


def test_help_shows_the_options():
    result = CliRunner(env={"COLUMNS": "200", "NO_COLOR": "1"}).invoke(app, ["fit", "--help"])
    assert result.exit_code == 0
    for option in ("--joints", "--joint", "--end-link", "--method", "--start", "--convergence", "--limit"):
        assert option in result.output
    assert "a .toml with a [curve]." in result.output  # not taken for markup
