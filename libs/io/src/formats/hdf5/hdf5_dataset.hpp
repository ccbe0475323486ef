#pragma once
#include <hdf5.h>

#include <string>

#include "formats/hdf5/hdf5_parcel.hpp"

namespace whirl::io {

/// A walk through a file.
struct Hdf5Visit {
  hid_t file;
  std::size_t bytes;  ///< of the file
  ParcelWriter& out;
  std::string problem = {};      ///< to be thrown when the library has returned
  hsize_t first = 0, count = 0;  ///< rows of the channels to be read; count 0: all
  hsize_t length = 0;            ///< of the channels, where rows are chosen
  bool measures = false;         ///< nothing is read: `length` becomes that of the longest
};

/// The numbers of a dataset, or what it is instead, into the parcel; a failure into `problem`.
void read_dataset(Hdf5Visit& visit, const char* path);

/// read_dataset of every dataset of the file, by groups in the order of their names; links to other files are not
/// followed and named. False when the tree is damaged.
bool walk(Hdf5Visit& visit);

}  // namespace whirl::io
