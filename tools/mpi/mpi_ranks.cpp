// Ranks on Boost.MPI, as a library that vrpipe loads when mpirun has started it.
#include <chrono>
#include <thread>
#include <vector>

#include <boost/mpi.hpp>
#include <boost/serialization/string.hpp>
#include <boost/serialization/vector.hpp>

#include "jobs/ranks.h"

namespace vrpipe::tools {
namespace {

namespace mpi = boost::mpi;

constexpr int record_tag = 1;

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    MPI_Comm here = MPI_COMM_NULL;
    MPI_Comm_split_type(world_, MPI_COMM_TYPE_SHARED, world_.rank(), MPI_INFO_NULL, &here);
    machine_ = mpi::communicator(here, mpi::comm_take_ownership);
    // The ranks before those of this machine's leader that lead, with theirs.
    const int slots = machine_.rank() == 0 ? machine_.size() : 0;
    std::vector<int> all;
    mpi::all_gather(world_, slots, all);
    for (int rank = 0; rank < world_.rank(); ++rank)
      first_slot_ += static_cast<unsigned>(all[static_cast<std::size_t>(rank)]);
  }

  bool is_first() const override { return world_.rank() == 0; }
  bool is_leader() const override { return machine_.rank() == 0; }
  unsigned slots() const override { return static_cast<unsigned>(machine_.size()); }
  unsigned all_slots() const override { return static_cast<unsigned>(world_.size()); }
  unsigned first_slot() const override { return first_slot_; }

  std::string broadcast(const std::string& text) override {
    std::string shared = text;
    mpi::broadcast(world_, shared, 0);
    return shared;
  }
  void send(const std::string& text) override { world_.send(0, record_tag, text); }
  std::optional<std::string> receive() override {
    if (!world_.iprobe(mpi::any_source, record_tag)) return std::nullopt;
    std::string text;
    world_.recv(mpi::any_source, record_tag, text);
    return text;
  }
  void wait_for_all() override {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibarrier(world_, &request);
    for (int done = 0; done == 0;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (done == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

 private:
  // One that is destroyed by an exception aborts the others.
  mpi::environment environment_{true};
  mpi::communicator world_, machine_;
  unsigned first_slot_ = 0;
};

}  // namespace
}  // namespace vrpipe::tools

extern "C" __attribute__((visibility("default"))) vrpipe::tools::Ranks* vrpipe_make_ranks() {
  return new vrpipe::tools::MpiRanks;
}
