// What holds for the signals of every format, and that no header made them larger than the bytes allow.
#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <string>

#include "harness.hpp"
#include "whirl/io/info.hpp"
#include "whirl/io/record_stream.hpp"

namespace whirl::fuzz {

/// `most_per_byte`: values that a byte of the file can stand for.
inline void check(const io::SignalFile& file, std::size_t bytes, std::size_t most_per_byte) {
  std::size_t values = 0;
  for (const io::SignalTable& table : file.tables) {
    require(table.step >= 0 || !table.abscissa);
    for (const io::Signal& signal : table.signals) {
      require(signal.value.size() == table.rows());
      require(signal.imaginary.size() == 0 || signal.imaginary.size() == signal.value.size());
      values += static_cast<std::size_t>(signal.value.size() + signal.imaginary.size());
    }
  }
  require(values <= most_per_byte * bytes);
  require(!to_string(io::describe(file)).empty());
  only_errors([&] { io::recording_of(file).check(); });
  only_errors([&] { io::recording_of(file, {.rate = 100, .columns = {"1:x_V*2"}}).check(); });
}

/// A file in memory; every run writes it anew.
inline std::filesystem::path file_of(std::string_view bytes) {
  static const int descriptor = memfd_create("fuzz", 0);
  require(descriptor >= 0 && ftruncate(descriptor, 0) == 0);
  require(pwrite(descriptor, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
  return "/proc/self/fd/" + std::to_string(descriptor);
}

/// The same file in parts of a few rows, and some rows of it: no more than its bytes allow, and what the whole has
/// where both are read.
/// both are read. `once`: each reading takes a process, and is done once.
inline void check_parts(const std::filesystem::path& path, std::size_t bytes, std::size_t most_per_byte,
                        bool once = false) {
  std::optional<io::SignalFile> whole;
  if (!once) only_errors([&] { whole = io::read_signals(path); });
  for (const Eigen::Index each : {65536, 7}) {
    if (once && each == 7) return;
    only_errors([&] {
      const auto stream = io::open_signal_stream(path, {}, {.each = each});
      Eigen::Index rows = 0, columns = 0;
      io::SignalFile part;
      for (int parts = 0; parts < 200 && stream->next(part); ++parts) {
        for (const io::SignalTable& table : part.tables) {
          columns = std::max(columns, static_cast<Eigen::Index>(table.signals.size()));
          for (const io::Signal& s : table.signals) require(s.value.size() == table.rows());
        }
        if (!part.tables.empty()) rows += part.tables.front().rows();
      }
      require(static_cast<std::size_t>(rows) <= most_per_byte * bytes);
      const bool compared = each > 7 && whole && whole->tables.size() == 1 && part.tables.size() == 1 &&
                            whole->tables[0].x.size() == 0 &&
                            part.tables[0].signals.size() == whole->tables[0].signals.size();
      if (compared && whole->tables[0].rows() < each) require(rows == whole->tables[0].rows());
    });
  }
  only_errors([&] { io::read_record_rows(path, {}, {.first = 1, .end = 4, .each = 2}).check(); });
}

}  // namespace whirl::fuzz
