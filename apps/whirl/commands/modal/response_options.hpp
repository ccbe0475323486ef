#pragma once
#include <string>

#include "command_line.hpp"
#include "whirl/io/formats.hpp"

namespace whirl::app {

/// Flags of every subcommand that reads frequency responses: what a file may leave open.
struct ResponseFlags {
  std::string kind, frequency_unit;
  int lines_dimension = 0;

  io::ResponseOptions options() const {
    io::ResponseOptions options(io::frf_kind(kind));
    options.frequency_unit = frequency_unit;
    options.lines_dimension = lines_dimension;
    return options;
  }

  void add_to(CommandLine* sub) {
    sub->add_option("--kind", kind,
                    "of files that state no unit, such as a CSV table: receptance, mobility or accelerance")
        ->one_of({"receptance", "mobility", "accelerance"});
    sub->add_option("--frequency-unit", frequency_unit,
                    "MAT, HDF5 and NumPy files that do not state it: unit of their frequencies")
        ->one_of({"hz", "kHz", "rad_s", "rpm"});
    sub->add_option("--lines-dimension", lines_dimension,
                    "MAT, HDF5 and NumPy files: dimension of the arrays that runs along the frequencies, from 1, where "
                    "several are as long")
        ->one_of_numbers({1, 2, 3});
  }
};

}  // namespace whirl::app
