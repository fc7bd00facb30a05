#pragma once

#include <memory>
#include <optional>
#include <string>

namespace vrpipe::tools {

/// The processes that `mpirun -n N` started, of which one a machine works for all that are on it: scenes are loaded once a
/// machine. In a library of its own, so that vrpipe does not need MPI.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual bool is_first() const = 0;   ///< keeps the journal, and writes the results
  virtual bool is_leader() const = 0;  ///< works, for the ranks of its machine
  virtual unsigned slots() const = 0;  ///< of its machine: ranks
  virtual unsigned all_slots() const = 0;
  virtual unsigned first_slot() const = 0;  ///< the machine has this and the next, of all

  /// Of the first, to all.
  virtual std::string broadcast(const std::string& text) = 0;
  /// To the first.
  virtual void send(const std::string& text) = 0;
  /// What has come to the first; none if there is nothing yet.
  virtual std::optional<std::string> receive() = 0;
  /// Until all ranks are here, without keeping a processor busy.
  virtual void wait_for_all() = 0;
};

/// Null in a process that mpirun did not start, or alone. Throws UserError if vrpipe was built without MPI.
std::unique_ptr<Ranks> join_ranks();

}  // namespace vrpipe::tools
