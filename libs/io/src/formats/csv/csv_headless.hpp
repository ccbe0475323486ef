#pragma once
#include <string>
#include <vector>

namespace whirl::io::detail {

/// The `--columns` of a table without names, as an example. `first`: the values of the first column in the first lines;
/// where they do not rise in even steps no column is the time, and `--rate` stands behind the columns. The rate is that
/// of the pair NAME.csv which an oscilloscope writes beside NAME.Wfm.csv, where there is one that states it.
std::string proposed_numbers(const std::string& file, std::size_t columns, const std::vector<double>& first);

}  // namespace whirl::io::detail
