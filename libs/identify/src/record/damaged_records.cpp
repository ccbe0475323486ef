#include "record/damaged_records.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/records/check.hpp"

namespace whirl::identification::detail {
namespace {

/// The samples without their part at `frequency` (Hz): least squares of a cosine, a sine and the mean.
void take_off_line(Eigen::VectorXd& v, double dt, double frequency) {
  const double w = 2 * std::numbers::pi * frequency * dt;
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i])) continue;
    const Eigen::Vector3d row(std::cos(w * static_cast<double>(i)), std::sin(w * static_cast<double>(i)), 1);
    a += row * row.transpose();
    b += row * v[i];
  }
  const Eigen::Vector3d c = a.ldlt().solve(b);
  for (Eigen::Index i = 0; i < v.size(); ++i)
    v[i] -= c[0] * std::cos(w * static_cast<double>(i)) + c[1] * std::sin(w * static_cast<double>(i));
}

}  // namespace

DamagedRecords look_for_damage(const std::vector<Recording>& records, const std::vector<std::string>& channels) {
  DamagedRecords found{{}, false, records};
  for (Recording& record : found.records) {
    const records::RecordReport report = records::check(record);
    for (const records::Finding& f : report.findings) {
      const bool asked = std::find(channels.begin(), channels.end(), f.channel) != channels.end();
      // Gaps are said where they are bridged; a slow mean may be the motion of a state.
      if (!asked || f.kind == records::FindingKind::gap || f.kind == records::FindingKind::drift) continue;
      found.findings.push_back((records.size() > 1 ? record.source + ", " : "") + f.text());
    }
    for (Channel& c : record.channels) {
      if (std::find(channels.begin(), channels.end(), c.name) == channels.end()) continue;
      if (const records::ChannelMask* mask = report.mask(c.name)) {
        found.cleaned = true;
        c.samples = mask->usable.select(c.samples.array(), std::numeric_limits<double>::quiet_NaN()).matrix();
      }
      for (const records::Finding& f : report.findings) {
        if (f.kind != records::FindingKind::hum || f.channel != c.name) continue;
        found.cleaned = true;
        take_off_line(c.samples, record.dt, f.frequency);
      }
    }
  }
  return found;
}

}  // namespace whirl::identification::detail
