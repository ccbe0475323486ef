#include "weak/integral_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification::detail {
namespace {

/// The channel with the most missing samples, and what to do; empty where none is missing.
std::string what_is_missing(const std::vector<Recording>& records, const SindyOptions& options) {
  double most = 0;
  std::string channel;
  for (const auto* names : {&options.states, &options.inputs}) {
    for (const std::string& name : *names) {
      double missing = 0, all = 0;
      for (const Recording& r : records) {
        const Eigen::VectorXd& samples = r[name];
        missing += static_cast<double>(samples.size() - samples.array().isFinite().count());
        all += static_cast<double>(samples.size());
      }
      if (!(missing > most * all)) continue;
      most = missing / all;
      channel = name;
    }
  }
  if (channel.empty()) return "";
  return fmt::format(
      ": channel {} has no reading at {:.0f} % of the instants. Channels must be read together: leave it out, bring "
      "all "
      "to the instants of the slowest one, or interpolate it before",
      channel, 100 * most);
}

}  // namespace

std::vector<Stretch> finite_stretches(const std::vector<Recording>& records, const SindyOptions& options) {
  constexpr Eigen::Index shortest = 25;
  std::vector<Stretch> out;
  for (std::size_t number = 0; number < records.size(); ++number) {
    const Recording& r = records[number];
    if (!(r.dt > 0)) throw Error(fmt::format("{}: sample time {:g} s: must be > 0", r.source, r.dt));
    const Eigen::Index n = r.size();
    Eigen::MatrixXd x(n, static_cast<Eigen::Index>(options.states.size()));
    Eigen::MatrixXd u(n, static_cast<Eigen::Index>(options.inputs.size()));
    const auto fill = [&](const std::vector<std::string>& names, Eigen::MatrixXd& columns) {
      for (std::size_t k = 0; k < names.size(); ++k) {
        const Eigen::VectorXd& samples = r[names[k]];
        if (samples.size() != n)
          throw Error(fmt::format("{}: channel '{}' is not as long as the first", r.source, names[k]));
        columns.col(static_cast<Eigen::Index>(k)) = samples;
      }
    };
    fill(options.states, x);
    fill(options.inputs, u);
    for (Eigen::Index first = 0; first < n;) {
      Eigen::Index end = first;
      while (end < n && x.row(end).allFinite() && u.row(end).allFinite()) ++end;
      if (end - first >= shortest) {
        Stretch s;
        s.source = r.source;
        s.record = number;
        s.dt = r.dt;
        s.t0 = r.t0 + r.dt * static_cast<double>(first);
        s.raw = x.middleRows(first, end - first);
        s.inputs = u.middleRows(first, end - first);
        out.push_back(std::move(s));
      }
      first = std::max(end, first) + 1;
    }
  }
  if (out.empty()) throw Error("no record has 25 finite samples in a row" + what_is_missing(records, options));
  return out;
}

signal::SmoothedSignal without_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd) {
  const double spread = std::sqrt((x.array() - x.mean()).square().mean());
  return noise_sd > 1e-3 * spread ? signal::smoothing_spline_for_noise(x, dt, noise_sd)
                                  : signal::smoothing_spline(x, dt, 0);
}

double channel_noise(const IdentifiedModel& model, const std::string& state,
                     const Eigen::Ref<const Eigen::VectorXd>& samples) {
  const double c = model.noise_correlation_of(state);
  return c == 0 ? signal::noise_sd(samples) : signal::innovation_sd(samples, c) / std::sqrt(1 - c * c);
}

Eigen::VectorXd noise_correlations(const SindyOptions& options) {
  if (options.noise_correlation.empty()) return {};
  Eigen::VectorXd each = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(options.states.size()));
  for (Eigen::Index k = 0; k < each.size(); ++k) {
    const auto known = options.noise_correlation.find(options.states[static_cast<std::size_t>(k)]);
    if (known != options.noise_correlation.end()) each[k] = known->second;
  }
  return each;
}

Eigen::VectorXd smooth_stretches(std::vector<Stretch>& stretches) {
  const Eigen::Index states = stretches.front().raw.cols();
  Eigen::VectorXd sd = Eigen::VectorXd::Zero(states);
  double total = 0;
  for (const Stretch& s : stretches) {
    const double weight = static_cast<double>(s.samples());
    total += weight;
    for (Eigen::Index k = 0; k < states; ++k) sd[k] += weight * std::pow(signal::noise_sd(s.raw.col(k)), 2);
  }
  sd = (sd / total).cwiseSqrt();
  for (Stretch& s : stretches) {
    s.smooth.resize(s.raw.rows(), states);
    s.rate.resize(s.raw.rows(), states);
    for (Eigen::Index k = 0; k < states; ++k) {
      const signal::SmoothedSignal g = without_noise(s.raw.col(k), s.dt, sd[k]);
      s.smooth.col(k) = g.value;
      s.rate.col(k) = g.first;
    }
  }
  return sd;
}

double characteristic_rate(const std::vector<Stretch>& stretches) {
  const Eigen::Index states = stretches.front().raw.cols();
  std::vector<double> rates;
  for (Eigen::Index k = 0; k < states; ++k) {
    double mean = 0, rows = 0, energy = 0, rate = 0;
    for (const Stretch& s : stretches) {
      mean += s.smooth.col(k).sum();
      rows += static_cast<double>(s.samples());
    }
    mean /= rows;
    for (const Stretch& s : stretches) {
      energy += (s.smooth.col(k).array() - mean).square().sum();
      rate += s.rate.col(k).squaredNorm();
    }
    if (energy > 0) rates.push_back(std::sqrt(rate / energy));
  }
  if (rates.empty()) throw Error("the records are constant: nothing to identify");
  return *std::max_element(rates.begin(), rates.end());
}

std::vector<std::string> library_names(const SindyOptions& options) {
  std::vector<std::string> names = options.states;
  if (options.order == 2) {
    for (const std::string& s : options.states) names.push_back(s + "'");
  }
  names.insert(names.end(), options.inputs.begin(), options.inputs.end());
  return names;
}

Eigen::MatrixXd library_variables(const Stretch& s, const SindyOptions& options) {
  const Eigen::Index n = s.samples(), states = s.raw.cols(), rates = options.order == 2 ? states : 0;
  Eigen::MatrixXd v(n, states + rates + s.inputs.cols() + 1);
  v.leftCols(states) = s.smooth;
  if (rates > 0) v.middleCols(states, rates) = s.rate;
  v.middleCols(states + rates, s.inputs.cols()) = s.inputs;
  for (Eigen::Index i = 0; i < n; ++i) v(i, v.cols() - 1) = s.t0 + s.dt * static_cast<double>(i);
  return v;
}

IntegralRows integral_rows(const Stretch& s, const Eigen::MatrixXd& columns, int order, Eigen::Index half) {
  half = std::clamp<Eigen::Index>(half, 4, (s.samples() - 1) / 2);
  const Eigen::Index width = 2 * half + 1;
  Eigen::VectorXd phi(width), derivative(width);
  const double t = s.dt * static_cast<double>(half);
  for (Eigen::Index i = 0; i < width; ++i) {
    const double x = static_cast<double>(i - half) / static_cast<double>(half), b = 1 - x * x;
    phi[i] = std::pow(b, 6);
    derivative[i] = order == 1 ? 12 * x * std::pow(b, 5) / t  // -phi'
                               : (-12 * std::pow(b, 5) + 120 * x * x * std::pow(b, 4)) / (t * t);
  }
  const Eigen::Index stride = std::max<Eigen::Index>(1, half / 3);
  const Eigen::Index rows = (s.samples() - width) / stride + 1;
  IntegralRows r{Eigen::MatrixXd(rows, columns.cols()), Eigen::MatrixXd(rows, s.raw.cols())};
  for (Eigen::Index i = 0; i < rows; ++i) {
    r.theta.row(i).noalias() = phi.transpose() * columns.middleRows(i * stride, width);
    r.target.row(i).noalias() = derivative.transpose() * s.raw.middleRows(i * stride, width);
  }
  // Divided by the integral of phi the rows are local averages, comparable between records.
  r.theta /= phi.sum();
  r.target /= phi.sum();
  return r;
}

}  // namespace whirl::identification::detail
