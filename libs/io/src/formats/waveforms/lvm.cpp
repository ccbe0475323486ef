// LabVIEW measurement files: text, a header for the file, one for each segment, then rows.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "formats/format.hpp"
#include "formats/text_lines.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

constexpr std::string_view kEnd = "***End_of_Header***";

class LvmReader {
 public:
  LvmReader(std::string_view bytes, std::string_view name) : lines_(bytes, std::string(name)) {
    file_.source = name;
    file_.format = "LVM";
  }

  SignalFile read() {
    if (!lines_.next().starts_with("LabVIEW Measurement")) lines_.fail("must start with 'LabVIEW Measurement'");
    separator_ = '\t';
    const Header header = read_header();
    if (const auto s = value(header, "Separator"); s == "Comma") separator_ = ',';
    if (const auto d = value(header, "Decimal_Separator"); !d.empty()) decimal_ = d.front();
    const std::string x = value(header, "X_Columns");
    x_columns_ = x == "No" ? 0 : x == "Multi" ? 2 : 1;
    while (!lines_.done()) {
      if (trim(lines_.peek()).empty()) {
        lines_.next();
      } else {
        read_segment();
      }
    }
    if (file_.tables.empty()) lines_.fail("no segment with data");
    say_found();
    return std::move(file_);
  }

 private:
  using Header = std::map<std::string, std::vector<std::string>>;

  std::vector<std::string_view> cells(std::string_view line) const {
    std::vector<std::string_view> out;
    while (true) {
      const std::size_t end = line.find(separator_);
      out.push_back(trim(line.substr(0, end)));
      if (end == std::string_view::npos) return out;
      line.remove_prefix(end + 1);
    }
  }

  Header read_header() {
    Header header;
    while (!lines_.done()) {
      const std::string_view line = lines_.next();
      if (trim(line).starts_with(kEnd)) return header;
      // The first header states the separator: its own lines may have either.
      const std::size_t first = line.find_first_of("\t,");
      if (first == std::string_view::npos) continue;
      std::vector<std::string> values;
      for (const auto& cell : cells(line.substr(first + 1))) values.emplace_back(cell);
      header[std::string(trim(line.substr(0, first)))] = std::move(values);
    }
    lines_.fail("file ends inside a header");
  }

  static std::string value(const Header& header, const char* key, std::size_t at = 0) {
    const auto found = header.find(key);
    return found != header.end() && at < found->second.size() ? found->second[at] : "";
  }

  double number(std::string_view cell, const std::string& what) const {
    std::string text(cell);
    if (decimal_ != '.') {
      for (char& c : text) c = c == decimal_ ? '.' : c;
    }
    if (const auto value = signed_number_of<double>(text); value && std::isfinite(*value)) return *value;
    lines_.fail(fmt::format("{}: '{}' must be a finite number", what, text.substr(0, 40)));
  }

  void read_segment() {
    const Header header = read_header();
    const double declared = number(value(header, "Channels"), "Channels");
    if (lines_.done()) lines_.fail("file ends before the names of the channels");
    const auto names = cells(lines_.next());
    // Columns: X and channels (No, One: one X column in front; Multi: one before each channel), perhaps a comment.
    if (!(declared >= 1 && declared <= static_cast<double>(names.size()))) {
      lines_.fail(fmt::format("{:.12g} channels declared, but {} columns", declared, names.size()));
    }
    const auto channels = static_cast<std::size_t>(declared);
    const std::size_t stride = x_columns_ == 2 ? 2 : 1, first = 1;
    if (first + stride * (channels - 1) >= names.size())
      lines_.fail(fmt::format("{} columns for {} channels", names.size(), channels));
    std::vector<std::string> titles;
    for (std::size_t c = 0; c < channels; ++c) titles.emplace_back(names[first + stride * c]);
    std::vector<std::vector<double>> values(channels), xs(x_columns_ == 2 ? channels : x_columns_);
    while (!lines_.done()) {
      const std::string_view line = lines_.peek();
      if (trim(line).empty() || line.starts_with("Channels")) break;
      lines_.next();
      const auto row = cells(line);
      for (std::size_t c = 0; c < channels; ++c) {
        const std::size_t at = first + stride * c;
        if (at >= row.size() || row[at].empty()) continue;  // channels may differ in length
        if (values[c].size() < values[0].size() && c == 0) lines_.fail("row without a value");
        values[c].push_back(number(row[at], titles[c]));
        if (x_columns_ == 2) xs[c].push_back(number(row[at - 1], "X_Value"));
      }
      if (x_columns_ == 1 && !row[0].empty()) xs[0].push_back(number(row[0], "X_Value"));
    }
    for (std::size_t c = 0; c < channels; ++c) {
      SignalTable table;
      if (segments_ > 0) table.name = fmt::format("segment {}", segments_ + 1);
      const std::string dimension = value(header, "X_Dimension", c);
      const Quantity over = dimension == "Frequency" ? Quantity::frequency : Quantity::time;
      const auto n = static_cast<Eigen::Index>(values[c].size());
      const std::string step = value(header, "Delta_X", c), start = value(header, "X0", c);
      if (!step.empty()) {
        table.abscissa = over;
        table.step = number(step, "Delta_X");
        table.start = start.empty() ? 0 : number(start, "X0");
      } else if (!xs.empty() && xs[std::min(c, xs.size() - 1)].size() == values[c].size()) {
        set_abscissa(table, over, Eigen::Map<const Eigen::VectorXd>(xs[std::min(c, xs.size() - 1)].data(), n));
      }
      const std::string declared_samples = value(header, "Samples", c);
      if (!declared_samples.empty() && number(declared_samples, "Samples") != static_cast<double>(n)) {
        found(fmt::format("header declares {} samples, {} are present", declared_samples, n), titles[c]);
      }
      Signal signal = make_signal(titles[c], value(header, "Y_Unit_Label", c),
                                  Eigen::Map<const Eigen::VectorXd>(values[c].data(), n));
      if (!signal.quantity) {
        found(signal.unit.empty() ? "no unit" : "the unknown unit '" + signal.unit + "'", titles[c]);
      }
      add_signal(file_, table, std::move(signal));
    }
    ++segments_;
  }

  /// What several channels have in common is said once.
  void found(const std::string& what, const std::string& channel) {
    const auto at = std::ranges::find(found_, what, &std::pair<std::string, std::vector<std::string>>::first);
    (at != found_.end() ? *at : found_.emplace_back(what, std::vector<std::string>{})).second.push_back(channel);
  }
  void say_found() {
    for (const auto& [what, channels] : found_) {
      constexpr std::size_t kNamed = 3;
      const std::vector<std::string> named(channels.begin(),
                                           channels.begin() + static_cast<long>(std::min(kNamed, channels.size())));
      file_.findings.push_back(
          channels.size() == 1 ? fmt::format("channel '{}': {}", named[0], what)
                               : fmt::format("{} ('{}'{}): {}", counted(channels.size(), "channel"),
                                             fmt::join(named, "', '"), channels.size() > kNamed ? ", ..." : "", what));
    }
  }

  TextLines lines_;
  SignalFile file_;
  std::vector<std::pair<std::string, std::vector<std::string>>> found_;
  char separator_ = '\t', decimal_ = '.';
  std::size_t x_columns_ = 1;
  int segments_ = 0;
};

}  // namespace

SignalFile parse_lvm(std::string_view bytes, std::string_view name) {
  SignalFile file = LvmReader(bytes, name).read();
  if (!bytes.empty() && bytes.back() != '\n' && bytes.back() != '\r')
    file.findings.push_back("its last line has no line end: the last number may be cut off");
  return file;
}

void write_lvm(const std::filesystem::path& path, const Recording& recording) {
  const auto per_channel = [&](const char* key, const auto& text) {
    std::string line = key;
    for (const Channel& channel : recording.channels) line += fmt::format("\t{}", text(channel));
    return line + "\n";
  };
  std::string out = fmt::format(
      "LabVIEW "
      "Measurement\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tNo\n"
      "X_Columns\tNo\nTime_Pref\tRelative\n{}\n\nChannels\t{}\n",
      kEnd, recording.channels.size());
  out += per_channel("Samples", [](const Channel& c) { return c.samples.size(); });
  out += per_channel("Y_Unit_Label", [](const Channel& c) { return si_unit(c.quantity); });
  out += per_channel("X_Dimension", [](const Channel&) { return "Time"; });
  out += per_channel("X0", [&](const Channel&) { return recording.t0; });
  out += per_channel("Delta_X", [&](const Channel&) { return recording.dt; });
  out += fmt::format("{}\n", kEnd);
  out += per_channel("X_Value", [](const Channel& c) { return c.name; });
  for (Eigen::Index i = 0; i < recording.size(); ++i) {
    for (const Channel& c : recording.channels) out += fmt::format("\t{}", c.samples[i]);
    out += '\n';
  }
  write_text(path, out);
}

Format lvm_format() {
  Format f{FileFormat::lvm, "LVM", {".lvm"}, [](std::string_view head) {
             if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
             return head.starts_with("LabVIEW Measurement");
           }};
  f.magic = true;
  f.read = [](const std::filesystem::path& path, const CsvOptions&) {
    return parse_lvm(read_text(path), path.string());
  };
  f.write = write_lvm;
  return f;
}

}  // namespace whirl::io
