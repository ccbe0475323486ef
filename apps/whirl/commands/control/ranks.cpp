#include "ranks.hpp"

#include <cstdlib>

#include "whirl/core/error.hpp"
#ifdef WHIRL_MPI
#include <mpi.h>
#endif

namespace whirl::app {

#ifdef WHIRL_MPI
MpiRanks::MpiRanks() {
  // Started alone, MPI would only cost time.
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr && std::getenv("PMI_SIZE") == nullptr) return;
  if (MPI_Init(nullptr, nullptr) != MPI_SUCCESS) throw Error("MPI does not start");
  started_ = true;
  MPI_Comm_rank(MPI_COMM_WORLD, &ranks_.rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks_.size);
  ranks_.gather = [size = ranks_.size, rank = ranks_.rank](const std::vector<double>& mine) {
    const int count = static_cast<int>(mine.size());
    std::vector<int> counts(static_cast<std::size_t>(size)), starts(static_cast<std::size_t>(size));
    MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, MPI_COMM_WORLD);
    int total = 0;
    for (std::size_t i = 0; rank == 0 && i < counts.size(); ++i) {
      starts[i] = total;
      total += counts[i];
    }
    std::vector<double> all(static_cast<std::size_t>(total));
    MPI_Gatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), starts.data(), MPI_DOUBLE, 0,
                MPI_COMM_WORLD);
    return all;
  };
  ranks_.broadcast = [](std::vector<double>& values) {
    MPI_Bcast(values.data(), static_cast<int>(values.size()), MPI_DOUBLE, 0, MPI_COMM_WORLD);
  };
}

MpiRanks::~MpiRanks() {
  if (started_) MPI_Finalize();
}
void MpiRanks::abort(int code) const {
  if (started_) MPI_Abort(MPI_COMM_WORLD, code);
}
#else
MpiRanks::MpiRanks() {
  const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (size != nullptr && std::atoi(size) > 1) throw Error("this whirl was built without MPI: run it without mpirun");
}
MpiRanks::~MpiRanks() = default;
void MpiRanks::abort(int) const {}
#endif

}  // namespace whirl::app
