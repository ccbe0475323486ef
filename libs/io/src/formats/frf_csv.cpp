#include "whirl/io/frf_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"

namespace whirl::io {

bool is_frequency_axis(const Channel& column) {
  const std::string name = small_letters(column.name);
  return column.quantity == Quantity::frequency && (name == "freq" || name == "frequency" || name == "f");
}

FrequencyResponse frf_from_table(const Table& table, FrfKind kind) {
  const auto axis = std::ranges::find_if(table.columns, is_frequency_axis);
  const Eigen::VectorXd& freq = axis != table.columns.end() ? axis->samples : table.in("freq", Quantity::frequency);
  FrequencyResponse frf;
  frf.kind = kind;
  frf.frequency = freq;
  const Eigen::Index lines = freq.size();
  const double step = lines > 1 ? (freq[lines - 1] - freq[0]) / static_cast<double>(lines - 1) : 0;
  for (Eigen::Index i = 0; i < lines; ++i) {
    if (!(step > 0) || std::abs(freq[i] - freq[0] - static_cast<double>(i) * step) > 0.05 * step) {
      throw Error::in_file(
          table.source, table.first_line + i,
          fmt::format("frequency {:g} Hz is not on a uniform ascending axis with a step of {:g} Hz", freq[i], step));
    }
  }
  std::size_t used = 1;
  for (const Channel& re : table.columns) {
    if (!re.name.ends_with("_re")) continue;
    FrfChannel channel;
    channel.response = re.name.substr(0, re.name.size() - 3);
    const Channel& im = table.at(channel.response + "_im");
    channel.value.resize(lines);
    channel.value.real() = re.samples;
    channel.value.imag() = im.samples;
    used += 2;
    if (const Channel* coherence = table.find(channel.response + "_coherence")) {
      channel.coherence = coherence->samples;
      ++used;
    }
    frf.channels.push_back(std::move(channel));
  }
  if (frf.channels.empty() || used != table.columns.size()) {
    throw Error::in_file(
        table.source, table.first_line - 1,
        "a table of frequency responses has the columns freq_hz and, for each channel, name_re, name_im "
        "and perhaps name_coherence_1, and no others");
  }
  return frf;
}

FrequencyResponse read_frf_csv(const std::filesystem::path& path, FrfKind kind) {
  const Table table = read_table(path);
  if (std::ranges::any_of(table.columns, is_frequency_axis)) return frf_from_table(table, kind);
  CsvOptions options;
  options.required = {"freq_hz"};
  return frf_from_table(read_table(path, options), kind);  // says what is missing
}

void write_frf_csv(const std::filesystem::path& path, const FrequencyResponse& frf) {
  std::set<std::string> names;
  for (const FrfChannel& c : frf.channels) {
    if (!c.response.empty() && c.response.find_first_of(",;:#\"\t\r\n") == std::string::npos) names.insert(c.response);
  }
  const bool keep = names.size() == frf.channels.size();
  Table table;
  table.columns.push_back({"freq", Quantity::frequency, frf.frequency});
  for (std::size_t i = 0; i < frf.channels.size(); ++i) {
    const FrfChannel& c = frf.channels[i];
    const std::string name = keep ? c.response : fmt::format("H{}", i + 1);
    table.columns.push_back({name + "_re", Quantity::dimensionless, c.value.real()});
    table.columns.push_back({name + "_im", Quantity::dimensionless, c.value.imag()});
    if (c.coherence.size() > 0) table.columns.push_back({name + "_coherence", Quantity::dimensionless, c.coherence});
  }
  write_csv(path, table);
}

}  // namespace whirl::io
