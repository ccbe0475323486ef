#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "whirl/modal/poles.hpp"

namespace whirl::modal {
namespace {

double median_of_sorted(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

struct Cluster {
  std::vector<std::size_t> members;
  std::set<int> orders;
  double size = 0, damping = 0;  // running medians of |s| and zeta

  void update(const std::vector<StabilisationPole>& poles) {
    std::vector<double> sizes, dampings;
    orders.clear();
    for (std::size_t i : members) {
      sizes.push_back(std::abs(poles[i].pole));
      dampings.push_back(poles[i].damping());
      orders.insert(poles[i].order);
    }
    size = median_of_sorted(sizes);
    damping = median_of_sorted(dampings);
  }
};

double distance(const Cluster& cluster, const StabilisationPole& pole, const PoleOptions& options) {
  return std::hypot((std::abs(pole.pole) / cluster.size - 1) / options.frequency_tolerance,
                    std::log(pole.damping() / cluster.damping) / (3 * options.damping_tolerance));
}

// Members outside 1.5 interquartile ranges (with a floor for tight clusters) in frequency or damping leave.
void prune(Cluster& cluster, const std::vector<StabilisationPole>& poles) {
  if (cluster.members.size() < 5) return;
  for (const bool by_damping : {false, true}) {
    const auto value = [&](std::size_t i) {
      return by_damping ? std::log(poles[i].damping()) : std::abs(poles[i].pole);
    };
    std::vector<double> values;
    for (std::size_t i : cluster.members) values.push_back(value(i));
    std::sort(values.begin(), values.end());
    const double q1 = values[values.size() / 4], q3 = values[(3 * values.size()) / 4];
    const double slack = 1.5 * (q3 - q1) + (by_damping ? 0.02 : 2e-5 * q3);
    std::erase_if(cluster.members, [&](std::size_t i) { return value(i) < q1 - slack || value(i) > q3 + slack; });
  }
  cluster.update(poles);
}

// Greedy sweep upwards in frequency: a pole joins the nearest of the last six clusters that has none of its order yet.
std::vector<Cluster> gather(const std::vector<StabilisationPole>& poles, const std::vector<std::size_t>& order,
                            const PoleOptions& options) {
  std::vector<Cluster> clusters;
  for (std::size_t i : order) {
    Cluster* nearest = nullptr;
    double best = 1;
    for (std::size_t back = 0; back < std::min<std::size_t>(6, clusters.size()); ++back) {
      Cluster& cluster = clusters[clusters.size() - 1 - back];
      const double d = distance(cluster, poles[i], options);
      if (d < best && !cluster.orders.contains(poles[i].order) &&
          mac(poles[cluster.members.front()].participation, poles[i].participation) >= options.min_mac) {
        best = d;
        nearest = &cluster;
      }
    }
    if (nearest == nullptr) nearest = &clusters.emplace_back();
    nearest->members.push_back(i);
    nearest->update(poles);
  }
  return clusters;
}

// Two clusters at one place are one pole whose members were shared out, unless they stand side by side in one order.
void merge(std::vector<Cluster>& clusters, const std::vector<StabilisationPole>& poles, const PoleOptions& options) {
  for (std::size_t a = 0; a < clusters.size(); ++a) {
    for (std::size_t b = a + 1; b < clusters.size(); ++b) {
      if (clusters[a].members.empty() || clusters[b].members.empty()) continue;
      if (std::abs(clusters[b].size / clusters[a].size - 1) > options.frequency_tolerance) continue;
      if (mac(poles[clusters[a].members.front()].participation, poles[clusters[b].members.front()].participation) <
          options.min_mac) {
        continue;
      }
      const auto shared = std::count_if(clusters[a].orders.begin(), clusters[a].orders.end(),
                                        [&](int o) { return clusters[b].orders.contains(o); });
      if (shared > 0) continue;
      clusters[a].members.insert(clusters[a].members.end(), clusters[b].members.begin(), clusters[b].members.end());
      clusters[b].members.clear();
      clusters[b].orders.clear();
      clusters[a].update(poles);
    }
  }
}

// Median pole of a cluster and its spread; the members are told the cluster's number.
PoleCluster describe(const Cluster& cluster, int number, std::vector<StabilisationPole>& poles) {
  std::vector<double> re, im, f, zeta;
  for (std::size_t i : cluster.members) {
    poles[i].cluster = number;
    re.push_back(poles[i].pole.real());
    im.push_back(poles[i].pole.imag());
  }
  PoleCluster found;
  found.pole = {median_of_sorted(re), median_of_sorted(im)};
  found.orders = static_cast<int>(cluster.orders.size());
  const double damping = -found.pole.real() / std::abs(found.pole);
  double nearest = INFINITY;
  for (std::size_t i : cluster.members) {
    f.push_back(std::abs(std::abs(poles[i].pole) - std::abs(found.pole)) / 6.283185307179586);
    zeta.push_back(std::abs(poles[i].damping() - damping));
    if (std::abs(poles[i].pole - found.pole) < nearest) {
      nearest = std::abs(poles[i].pole - found.pole);
      found.participation = poles[i].participation;
    }
  }
  found.frequency_spread = median_of_sorted(f);
  found.damping_spread = median_of_sorted(zeta);
  return found;
}

}  // namespace

std::vector<PoleCluster> select_poles(StabilisationDiagram& diagram, const PoleOptions& options) {
  auto& poles = diagram.poles;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < poles.size(); ++i) {
    poles[i].cluster = -1;
    if (poles[i].stable()) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return std::abs(poles[a].pole) < std::abs(poles[b].pole); });

  std::vector<Cluster> clusters = gather(poles, order, options);
  for (auto& cluster : clusters) prune(cluster, poles);
  merge(clusters, poles, options);

  const double needed = options.presence * static_cast<double>(diagram.orders.size());
  std::vector<PoleCluster> result;
  std::erase_if(clusters,
                [&](const Cluster& c) { return c.members.empty() || static_cast<double>(c.orders.size()) < needed; });
  std::sort(clusters.begin(), clusters.end(), [](const auto& a, const auto& b) { return a.size < b.size; });
  for (const auto& cluster : clusters) {
    result.push_back(describe(cluster, static_cast<int>(result.size()), poles));
  }
  return result;
}

}  // namespace whirl::modal
