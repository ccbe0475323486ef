#include "whirl/io/provenance.hpp"

#include "whirl/io/hash.hpp"

namespace whirl::io {

Provenance provenance(const std::vector<std::filesystem::path>& inputs, std::string options, unsigned long long seed) {
  Provenance p;
  p.version = version();
  for (const auto& path : inputs) p.inputs.push_back(input_record(path));
  p.options = std::move(options);
  p.seed = seed;
  return p;
}

}  // namespace whirl::io
