#pragma once
#include <gtest/gtest.h>

#include "fmu_models.hpp"
#include "importer.hpp"
#include "whirl/deploy/fmu.hpp"

namespace whirl::deploy {

using testing::Importer;

/// Version of the standard.
class FmuExport : public ::testing::TestWithParam<int> {
 protected:
  template <class T>
  Importer import(const T& value, FmuOptions options = {}) {
    options.version = GetParam();
    options.code.prefix = "unit";
    const auto path = folder.path() / "unit.fmu";
    pack_fmu(fmu_files(value, options), options, path);
    return {path, folder.path() / "unpacked"};
  }
  testing::TemporaryFolder folder;
};

}  // namespace whirl::deploy
