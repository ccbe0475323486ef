#include <algorithm>
#include <map>

#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/signal/angle.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification {

expr::CandidateLibrary in_channel_names(const expr::CandidateLibrary& library) {
  static const std::map<std::string, std::string, std::less<>> kNames{
      {"X1", "x"}, {"X2", "x'"}, {"X3", "y"}, {"X4", "y'"}, {"X5", "beta"}, {"X6", "beta'"}, {"X7", "beta''"}};
  std::map<std::string, expr::Expr, std::less<>> channels;
  for (const auto& [state, channel] : kNames) channels.emplace(state, expr::Expr::symbol(channel));
  expr::CandidateLibrary out = library;
  for (std::string& lhs : out.lhs) {
    const auto at = kNames.find(lhs.substr(0, lhs.find('\'')));
    if (at != kNames.end()) lhs = at->second + lhs.substr(lhs.find('\''));
  }
  for (expr::TiedGroup& group : out.groups) {
    for (expr::TiedEntry& entry : group.entries) entry.function = expr::substitute(entry.function, channels);
  }
  for (expr::Expr& known : out.known) known = expr::substitute(known, channels);
  for (std::string& name : out.variables) {
    if (const auto at = kNames.find(name); at != kNames.end()) name = at->second;
  }
  return out;
}

Recording with_derivatives(const Recording& record, const std::vector<std::string>& names) {
  Recording out = record;
  for (Channel& c : out.channels) {  // readings of an angle may be wrapped and quantised
    if (c.quantity == Quantity::angle && std::find(names.begin(), names.end(), c.name) != names.end()) {
      c.samples = signal::angle_from_encoder(c.samples, record.dt)
                      .angle.beta(Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2}))
                      .eval();
    }
  }
  for (const std::string& name : names) {
    if (out.has(name) || !name.ends_with('\'')) continue;
    const std::string base = name.substr(0, name.find('\''));
    const std::size_t order = name.size() - base.size();
    if (order > 2) throw Error::in_field("derivative", name, "the first or second of a channel");
    const Channel& channel = record.at(base);
    Eigen::VectorXd rate;
    Quantity quantity = Quantity::dimensionless;
    if (channel.quantity == Quantity::angle) {
      const AngleSignal angle = signal::angle_from_encoder(channel.samples, record.dt).angle;
      const Eigen::VectorXd& signal = order == 1 ? angle.omega : angle.alpha;
      rate = signal(Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2}));
      quantity = order == 1 ? Quantity::angular_velocity : Quantity::angular_acceleration;
    } else {
      const signal::SmoothedSignal s =
          detail::without_noise(channel.samples, record.dt, signal::noise_sd(channel.samples));
      rate = order == 1 ? s.first : s.second;
      if (channel.quantity == Quantity::displacement) {
        quantity = order == 1 ? Quantity::velocity : Quantity::acceleration;
      }
    }
    out.add(name, quantity, std::move(rate));
  }
  return out;
}

}  // namespace whirl::identification
