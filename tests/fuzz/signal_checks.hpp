// What holds for the signals of every format, and that no header made them larger than the bytes allow.
#pragma once
#include "harness.hpp"
#include "whirl/io/info.hpp"

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

}  // namespace whirl::fuzz
