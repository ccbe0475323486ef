// Promises of `whirl rotor fit` on rotors that its library does not make (testing/shaft/shaft_rig.hpp): median errors,
// coverage of the intervals, what is named as not identifiable, verdict on a wrong drawing, virtual probe, time.
//     bench_shaft_fit ROW FILE [RUNS [FIRST_SEED]]
// ROW: two, tolerated, unstated, linear, first, first-linear; two-alone, first-alone: one run, no trial mass. Each
// rotor is a line of FILE; what it holds is not run again.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <sstream>

#include "whirl/testing/shaft/rotor_population.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;
using Kind = shaft::UnknownKind;

struct Row {
  PopulationOptions population;
  bool stated = false, linear = false;
};

Row row_of(const std::string& name) {
  Row row;
  const GeometryErrors errors{0.01, 0.001, 2e-3, 0.005};
  if (name == "tolerated" || name == "unstated") row.population.errors = errors;
  row.stated = name == "tolerated";
  row.linear = row.population.linear = name == "linear" || name == "first-linear";
  row.population.second_critical = !name.starts_with("first");
  row.population.trial = !name.ends_with("alone");
  return row;
}

/// Numbers of one rotor, by name.
using Line = std::map<std::string, double>;

/// Truth of an unknown as the fit counts it: a change over speed is that from the middle of the records' speeds to
/// their highest, which the machine counts over its own range.
double truth_of(const RotorCase& c, const shaft::FitUnknown& u, double lowest, double highest) {
  if (u.kind == Kind::stiffness || u.kind == Kind::damping) {
    const RigBearing& b = c.rig.bearings[u.index];
    const bool k = u.kind == Kind::stiffness, x = u.row == 0;
    const double middle = k ? (x ? b.kx : b.ky) : (x ? b.cx : b.cy);
    const double change = k ? (x ? b.kx1 : b.ky1) : (x ? b.cx1 : b.cy1);
    const double one = change / (0.5 * (c.rig.highest - c.rig.lowest));
    if (u.part == 1) return one * 0.5 * (highest - lowest);
    return middle + one * 0.5 * (highest + lowest - c.rig.highest - c.rig.lowest);
  }
  if (u.kind == Kind::material_damping) return c.rig.damping_time;
  const auto z = std::polar(c.rig.masses[u.index].size, c.rig.masses[u.index].angle);
  return u.part == 0 ? z.real() : z.imag();
}

/// What the noise-free records of the machine leave unexplained by the drawing, in standard deviations of a chi-square.
double true_misfit(const RotorCase& c, const Row& row, unsigned seed, const shaft::FitSetup& setup) {
  PopulationOptions quiet = row.population;
  quiet.noise_db = std::numeric_limits<double>::infinity();
  quiet.start_stiffness = quiet.start_damping = 1;  // another draw of the starts alone
  RotorCase clean = make_rotor_case(seed, quiet);
  clean.drawing = c.drawing;
  const std::vector<shaft::OrderRun> runs = order_runs(clean);
  const shaft::RotorFit fit = shaft::fit_rotor(c.drawing, setup, runs, {.restarts = 3});
  double sum = 0, count = 0;
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (Eigen::Index p = 0; p < fit.residuals[r].rows(); ++p) {
      const Eigen::VectorXd& x = clean.records[r].channels[static_cast<std::size_t>(p)].samples;
      const double sd =
          x.norm() / std::sqrt(static_cast<double>(x.size())) * std::pow(10, -row.population.noise_db / 20);
      for (Eigen::Index b = 0; b < fit.residuals[r].cols(); ++b)
        sum += std::norm(fit.residuals[r](p, b)) * runs[r].samples[b] / (2 * sd * sd);
      count += 2 * static_cast<double>(fit.residuals[r].cols());
    }
  return sum / std::sqrt(2 * count);
}

Line run_one(const Row& row, const std::string& name, unsigned seed) {
  const RotorCase c = make_rotor_case(seed, row.population);
  const std::clock_t begin = std::clock();
  const std::vector<shaft::OrderRun> runs = order_runs(c);
  shaft::FitSetup setup;
  setup.trials = c.trials;
  setup.tolerance.probe_gain = 0.05;
  if (row.linear) setup.stiffness = setup.damping = shaft::OverSpeed::linear;
  if (row.stated) {
    const GeometryErrors& e = row.population.errors;
    setup.tolerance.youngs_modulus = e.young;
    setup.tolerance.diameter = e.diameter;
    setup.tolerance.disc_position = e.disc_position;
    setup.tolerance.disc_mass = e.disc_mass;
  }
  const shaft::RotorFit fit = shaft::fit_rotor(c.drawing, setup, runs);
  Line line;
  line["seconds"] = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  line["starts"] = fit.starts;
  line["iterations"] = fit.iterations;
  line["chi"] = fit.misfit.chi_square;
  line["dev"] = fit.misfit.deviations;
  line["band"] = fit.misfit.band_deviations;
  line["explained"] = fit.misfit.explained;
  line["converged"] = 1;
  line["slopes_open"] = line["material_open"] = 1;
  double lowest = std::numeric_limits<double>::infinity(), highest = 0;
  for (const shaft::OrderRun& run : runs) {
    lowest = std::min(lowest, run.speed.minCoeff());
    highest = std::max(highest, run.speed.maxCoeff());
  }
  for (const shaft::FitUnknown& u : fit.unknowns) {
    if (u.kind == Kind::material_damping) line["material_open"] = !u.identifiable;
    if (u.kind == Kind::damping && u.part == 1 && u.identifiable) line["slopes_open"] = 0;
    if (u.kind != Kind::stiffness && u.kind != Kind::damping && u.kind != Kind::unbalance) continue;
    const double truth = truth_of(c, u, lowest, highest);
    const char* key = u.kind == Kind::stiffness ? "K" : u.kind == Kind::damping ? "C" : "U";
    line[std::string("cover_") + key] += u.estimate.covers(truth);
    line[std::string("count_") + key] += 1;
    if (u.kind == Kind::unbalance || u.part == 1) continue;
    const double error = std::abs(u.estimate.value / truth - 1);
    line[std::string("err_") + key + std::to_string(2 * u.index + static_cast<std::size_t>(u.row))] = error;
    if (u.kind == Kind::stiffness && error > 0.05) line["converged"] = 0;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const auto z = std::polar(c.rig.masses[k].size, c.rig.masses[k].angle);
    line["err_U" + std::to_string(k)] =
        std::abs(std::polar(fit.rotor.unbalances[k].size, fit.rotor.unbalances[k].angle) / z - 1.0);
  }
  std::vector<double> speeds;
  for (int k = 0; k < 60; ++k) speeds.push_back(25 + (c.top - 25) * k / 59);
  const shaft::VirtualProbe v = shaft::virtual_probe(fit, fit.rotor.discs[1].position, speeds);
  const ShaftRigModel model(c.rig);
  double off = 0, all = 0, covered = 0;
  for (Eigen::Index k = 0; k < 60; ++k) {
    const Eigen::Vector2cd truth = model.steady(speeds[static_cast<std::size_t>(k)], c.rig.discs[1].position);
    off += std::norm(v.x[k] - truth[0]) + std::norm(v.y[k] - truth[1]);
    all += truth.squaredNorm();
    covered += (std::abs(std::abs(v.x[k]) - std::abs(truth[0])) <= v.x_half[k]) / 120.0 +
               (std::abs(std::abs(v.y[k]) - std::abs(truth[1])) <= v.y_half[k]) / 120.0;
  }
  line["err_V"] = std::sqrt(off / all);
  line["cover_V"] = covered;
  if (name == "unstated") line["misfit"] = true_misfit(c, row, seed, setup);
  return line;
}

double median(std::vector<double> v) {
  if (v.empty()) return std::nan("");
  std::nth_element(v.begin(), v.begin() + static_cast<long>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

void summarise(const std::string& name, const std::vector<Line>& lines) {
  std::map<std::string, std::vector<double>> values;
  std::map<std::string, double> sums;
  double failed = 0, misfits = 0, false_alarms = 0;
  for (const Line& l : lines) {
    for (const auto& [key, value] : l) {
      sums[key] += value;
      if (key.starts_with("err_")) values[key.substr(0, 5)].push_back(value);
      if (key == "seconds" || key == "iterations" || key == "misfit") values[key].push_back(value);
    }
    if (!l.at("explained")) false_alarms += 1;
    if (l.count("misfit") && l.at("misfit") > 3) {
      misfits += 1;
      failed += !l.at("explained");
    }
  }
  const auto n = static_cast<double>(lines.size());
  std::printf("%s: %.0f rotors, %.0f converged, %.0f verdicts against the model\n", name.c_str(), n, sums["converged"],
              false_alarms);
  std::printf("  median error K %.3f %%, C %.3f %%, U %.3f %%, virtual probe %.3f %%\n", 100 * median(values["err_K"]),
              100 * median(values["err_C"]), 100 * median(values["err_U"]), 100 * median(values["err_V"]));
  std::printf(
      "  coverage K %.3f, C %.3f, U %.3f, all %.3f; virtual probe %.3f\n", sums["cover_K"] / sums["count_K"],
      sums["cover_C"] / sums["count_C"], sums["cover_U"] / sums["count_U"],
      (sums["cover_K"] + sums["cover_C"] + sums["cover_U"]) / (sums["count_K"] + sums["count_C"] + sums["count_U"]),
      sums["cover_V"] / n);
  std::printf("  not identifiable: material damping %.0f, all changes of damping over speed %.0f\n",
              sums["material_open"], sums["slopes_open"]);
  if (misfits > 0) std::printf("  misfit above 3 sigma in %.0f, verdict fails in %.0f\n", misfits, failed);
  std::printf("  processor time median %.2f s, largest error of a virtual probe %.2f %%\n", median(values["seconds"]),
              100 * *std::ranges::max_element(values["err_V"]));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::puts("usage: bench_shaft_fit ROW FILE [RUNS [FIRST_SEED]]"), 2;
  const std::string name = argv[1];
  const Row row = row_of(name);
  const unsigned runs = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 50;
  const unsigned first = argc > 4 ? static_cast<unsigned>(std::atoi(argv[4])) : 1001;
  std::map<unsigned, Line> lines;
  std::ifstream in(argv[2]);
  for (std::string text; std::getline(in, text);) {
    std::istringstream words(text);
    unsigned seed = 0;
    words >> seed;
    Line line;
    for (std::string key; words >> key;) words >> line[key];
    if (line.count("end") > 0) lines[seed] = line;
  }
  in.close();
  for (unsigned seed = first; seed < first + runs; ++seed) {
    if (lines.count(seed) > 0) continue;
    Line line = run_one(row, name, seed);
    line["end"] = 1;
    std::ofstream out(argv[2], std::ios::app);
    out << seed;
    for (const auto& [key, value] : line)
      if (key != "end") out << ' ' << key << ' ' << value;
    out << " end 1\n";
    lines[seed] = std::move(line);
  }
  std::vector<Line> all;
  for (const auto& [seed, line] : lines)
    if (seed >= first && seed < first + runs) all.push_back(line);
  summarise(name, all);
}
