#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "../program.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/control/part_models.hpp"

/// Numbers of the program's answers, for the tests of docs/parts.md.
namespace whirl::testing {

struct Answer {
  io::Json json;
  int exit_code = 0;
  io::JsonReader read() const { return {json, "stdout"}; }
};

/// Runs the program with --json; the answer is empty where it prints none.
inline Answer ask(const Folder& folder, const std::string& arguments) {
  const Outcome out = folder.whirl(arguments + " --json --force");
  Answer a;
  a.exit_code = out.exit_code;
  if (out.out.empty()) {
    ADD_FAILURE() << arguments << "\n" << out.err;
    a.json = io::Json::object();
    return a;
  }
  a.json = io::parse_json(out.out, "stdout");
  return a;
}

/// The findings of a code in the summary of an answer.
inline std::vector<Finding> findings(const Answer& answer, FindingCode code) {
  std::vector<Finding> out;
  const io::JsonReader in = answer.read();
  if (!in.has("summary")) return out;
  for (const Finding& f : io::read_summary(in.at("summary")).findings)
    if (f.code == code) out.push_back(f);
  return out;
}
inline const Finding* left_out(const std::vector<Finding>& all, identification::ModelPart part) {
  const auto at = std::ranges::find(all, std::string(to_string(part)), &Finding::where);
  return at == all.end() ? nullptr : &*at;
}

/// Amplitude of the steady response at a speed, m.
inline double response_at(const Folder& folder, const std::string& model, double hz) {
  const Answer a = ask(folder, fmt::format("response {} --from-rpm {} --to-rpm {}", model, 60 * hz, 60 * hz + 3));
  return a.read().at("points").items().front().at("amplitude").number();
}

/// Largest radius of the last half second of a run of ten seconds at that speed, m.
inline double simulated_at(const Folder& folder, const std::string& model, double hz) {
  ask(folder, fmt::format("simulate {} --from-rpm {} --to-rpm {} --seconds 10 --rate-hz 1000 --out steady.csv", model,
                          60 * hz, 60 * hz));
  const io::Table run = io::read_table(folder / "steady.csv");
  return (run["x"].tail(500).array().square() + run["y"].tail(500).array().square()).sqrt().maxCoeff();
}

/// A run-up by `simulate` as a record with x, y, beta; `read` changes what the probes read.
template <class Read>
void write_record(const Folder& folder, const std::string& model, double to_hz, const Read& read) {
  ask(folder, fmt::format("simulate {} --from-rpm 120 --to-rpm {} --seconds 10 --rate-hz 1000 --out true.csv", model,
                          60 * to_hz));
  const io::Table run = io::read_table(folder / "true.csv");
  Recording r;
  r.dt = 1e-3;
  Eigen::MatrixX2d z(run["x"].size(), 2);
  z << run["x"], run["y"];
  read(z, run["beta"]);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0, 1e-6);
  z = z.unaryExpr([&](double v) { return v + normal(random); });
  r.add("x", Quantity::displacement, z.col(0));
  r.add("y", Quantity::displacement, z.col(1));
  r.add("beta", Quantity::angle, run["beta"]);
  io::write_csv(folder / "run.csv", r);
}
inline void write_record(const Folder& folder, const std::string& model, double to_hz = 20) {
  write_record(folder, model, to_hz, [](Eigen::MatrixX2d&, const Eigen::VectorXd&) {});
}

/// rms error of x of a model on run.csv, m.
inline double validated(const Folder& folder, const std::string& model) {
  const Answer answer = ask(folder, "validate " + model + " run.csv");
  const io::JsonReader run = answer.read().at("runs").items().front();
  return std::hypot(run.at("rmse_x").number(), run.at("rmse_y").number());
}

}  // namespace whirl::testing
