#include "jobs/ranks.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include <vrpipe/component/error.h>

namespace vrpipe::tools {
namespace {

/// As Open MPI and those that follow PMI say it.
bool was_started_with_others() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"}) {
    const char* const size = std::getenv(name);
    if (size != nullptr && std::strtol(size, nullptr, 10) > 1) return true;
  }
  return false;
}

}  // namespace

std::unique_ptr<Ranks> join_ranks() {
  if (!was_started_with_others()) return nullptr;
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const std::filesystem::path& place :
       {folder.parent_path() / "lib" / "vrpipe_mpi.so", folder.parent_path() / VRPIPE_MPI_FOLDER / "vrpipe_mpi.so"}) {
    if (!std::filesystem::exists(place, ignored)) continue;
    void* const library = ::dlopen(place.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr)
      throw UserError("cannot use MPI", place.string(), ::dlerror(), "install Open MPI, or run without mpirun");
    using Make = Ranks* (*)();
    const auto make = reinterpret_cast<Make>(::dlsym(library, "vrpipe_make_ranks"));
    if (make != nullptr) return std::unique_ptr<Ranks>(make());
  }
  throw UserError("cannot use MPI", "mpirun", "this vrpipe was built without it",
                  "build it where Boost.MPI is (libboost-mpi-dev), or share the study by --shard");
}

}  // namespace vrpipe::tools
