// Any file of signals, responses or geometry as the program opens it: the content decides the format. The bytes stand
// in a file that lives in memory. What begins as HDF5 is left to fuzz_hdf5 (it is read in a process of its own).
#include "signal_checks.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/geometry.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  if (bytes.find("\x89HDF") != std::string_view::npos) return;
  const auto path = file_of(bytes);
  // A byte of gzip or of a deflated member of an archive may stand for a thousand values.
  only_errors([&] { check(io::read_signals(path), bytes.size(), 1100); });
  check_parts(path, bytes.size(), 1100);
  only_errors([&] {
    const auto frf = io::read_responses(path, FrfKind::accelerance);
    if (!frf) return;
    for (const FrfChannel& c : frf->channels) require(c.value.size() == frf->frequency.size());
  });
  only_errors([&] {
    const io::Geometry g = io::read_geometry(path);
    for (const auto& line : g.lines) require(line[0] < g.nodes.size() && line[1] < g.nodes.size());
  });
}
