#include <fmt/format.h>

#include <set>
#include <vector>

#include "formats/hdf5/hdf5_dataset.hpp"
#include "formats/hdf5/hdf5_library.hpp"

namespace whirl::io {
namespace {

struct Hdf5Object {
  std::string path;
  haddr_t address;
  H5O_type_t type;
  unsigned names;  ///< hard links to it
};

/// What a group holds, in the order of the names.
struct Hdf5Listing {
  std::vector<Hdf5Object> objects;
  long elsewhere = 0;  ///< links to other files
};

herr_t list_link(hid_t group, const char* name, const H5L_info_t* link, void* user) {
  Hdf5Listing& out = *static_cast<Hdf5Listing*>(user);
  if (link->type == H5L_TYPE_SOFT) return 0;
  if (link->type != H5L_TYPE_HARD) {
    ++out.elsewhere;
    return 0;
  }
  H5O_info_t info{};
  if (H5Oget_info_by_name(group, name, &info, H5P_DEFAULT) < 0) return -1;
  out.objects.push_back({name, info.addr, info.type, info.rc});
  return 0;
}

}  // namespace

bool walk(Hdf5Visit& visit) {
  std::vector<Hdf5Object> stack;
  std::set<haddr_t> met;  // objects of several names: read once, and circles end
  long elsewhere = 0;
  const auto list = [&](hid_t group, const std::string& path) {
    Hdf5Listing listing;
    if (group < 0 || H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, list_link, &listing) < 0) return false;
    elsewhere += listing.elsewhere;
    for (auto object = listing.objects.rbegin(); object != listing.objects.rend(); ++object) {
      if (!path.empty()) object->path.insert(0, path + "/");
      if (!object->path.starts_with("#refs#")) stack.push_back(std::move(*object));  // what MATLAB's cells point to
    }
    return true;
  };
  H5O_info_t root{};
  if (H5Oget_info(visit.file, &root) < 0 || !list(visit.file, "")) return false;
  met.insert(root.addr);
  while (!stack.empty() && visit.problem.empty()) {
    const Hdf5Object object = std::move(stack.back());
    stack.pop_back();
    if (object.names > 1 && !met.insert(object.address).second) continue;
    if (object.type == H5O_TYPE_DATASET) read_dataset(visit, object.path.c_str());
    // By its address: the way along a path is as long as the tree is deep.
    if (object.type != H5O_TYPE_GROUP) continue;
    if (const Hdf5Id group(H5Oopen_by_addr(visit.file, object.address), H5Oclose); !list(group, object.path))
      return false;
  }
  if (elsewhere > 0 && visit.problem.empty())
    put(visit.out, fmt::format("{} links to other files (not followed)", elsewhere), Piece::finding);
  return true;
}

}  // namespace whirl::io
