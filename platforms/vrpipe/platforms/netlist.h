#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/parameter.h>

namespace vrpipe {

/// What a link is, set as `link.NAME.PARAMETER`: NAME is the sending unit's path and its port without "out_", for
/// instance gpc0.tc.bins, or, of all GPCs alike, tc.bins.
struct LinkParameters : ParameterSet {
  LinkParameters(std::uint32_t items, std::uint32_t cycles);
  Integer depth;
  Integer latency_cycles;
  Integer items_per_cycle;
};

/// A unit or a memory of a platform.
struct Instance {
  std::string path;            ///< gpc0.tc; vpo, which serves all GPCs
  std::string slot;            ///< the kind of unit: tc
  std::string implementation;  ///< another than the slot's default; empty for that
  unsigned gpc = 0;            ///< from the path; 0 in the front end
  bool in_front_end = true;    ///< serves all GPCs
};

/// A connection of two units.
struct Link {
  std::string from;  ///< PATH.PORT of the sending end
  std::string to;    ///< and of the receiving end
  std::shared_ptr<LinkParameters> parameters;
  std::string name() const;  ///< as in `link.NAME`
};

/// A memory of another make: its SystemC module and sockets (foreign_memory.h).
struct ForeignMemory;
/// Makes the module of a name for so many units. At fidelities without time there are no accesses, and it is not called.
using MemoryMaker = std::function<ForeignMemory(const std::string& name, unsigned units)>;

struct ForeignInstance {
  std::string path;
  MemoryMaker make;
};

/// From the memory port of a unit, or of a memory above, to a memory. Each is the path of an instance.
struct MemoryLink {
  std::string from;
  std::string to;
};

/// A GPU as a list of units and links, which every fidelity elaborates: what is missing here is missing everywhere. A
/// platform's `wire` fills it in; another's can be taken and edited. All throw UserError for a path or port that is not
/// there, or is taken.
class Netlist {
 public:
  /// @param gpcs  that the platform has
  explicit Netlist(unsigned gpcs) : gpcs_(gpcs) {}
  unsigned gpcs() const { return gpcs_; }

  /// Adds a unit, or a memory of this library. The path ends in its slot, or `slot` says what it is; gpcN. at its
  /// beginning puts it in a GPC.
  void add(const std::string& path, const std::string& slot = "", const std::string& implementation = "");
  /// Says that there is no unit of a slot, and that nobody need mind: choices and settings of one are checked and change
  /// nothing. Without it they are refused.
  void do_without(const std::string& slot) { absent_.push_back(slot); }
  const std::vector<std::string>& absent() const { return absent_; }
  /// Connects two ports, PATH.PORT each. `depth`: items that the receiver's queue holds; `latency`: cycles from push to
  /// visibility, at least 1. Ports are checked when the netlist is elaborated.
  void connect(const std::string& from, const std::string& to, unsigned depth = 4, unsigned latency = 1);

  /// Adds a memory of another make.
  void add_memory(const std::string& path, MemoryMaker make);
  /// Puts a memory of another make in the place of a memory. It has nothing below.
  void replace_memory(const std::string& path, MemoryMaker make);
  /// Binds the memory port of a unit to a memory; or of a memory, which then lies above. It is moved if it was bound.
  void connect_memory(const std::string& from, const std::string& memory);
  /// Puts a memory of this library, which is there, between the memory port of a unit and what that is bound to.
  void insert_memory(const std::string& from, const std::string& memory);

  /// Puts another implementation into an instance.
  void replace(const std::string& path, const std::string& implementation);
  /// Puts a unit into the link that begins at a port: `path` with its ports `in` and `out`. The new link, behind it, is
  /// like the old one.
  void insert(const std::string& from, const std::string& path, const std::string& slot, const std::string& in,
              const std::string& out, const std::string& implementation = "");
  /// Takes a unit out, with its links; the ports at their other ends are stubbed.
  void remove(const std::string& path);
  /// Takes a link out. Its ends are stubbed, if they are not connected again.
  void disconnect(const std::string& from);
  /// Takes a memory out. What is bound to it is bound to nothing then.
  void remove_memory(const std::string& path);
  /// Leaves a port legally unconnected: nothing comes, and what is sent is lost.
  void stub(const std::string& port);

  const std::vector<Instance>& instances() const { return instances_; }
  const std::vector<Link>& links() const { return links_; }
  const std::vector<ForeignInstance>& foreign_memories() const { return foreign_memories_; }
  const std::vector<MemoryLink>& memory_links() const { return memory_links_; }
  /// The paths of what is bound to a memory, in the order of its ports.
  std::vector<std::string> bound_to(const std::string& memory) const;
  /// The paths of the memories that a unit's port is bound to, or one of these; in the order in which they were added,
  /// those of another make at the end.
  std::vector<std::string> used_memories() const;
  /// Whether an instance is a memory of this library.
  static bool is_memory(const Instance& instance);
  const std::vector<std::string>& stubs() const { return stubs_; }

  /// Whether a memory of another make is there.
  bool has_foreign(const std::string& path) const;
  /// Null for none.
  const Instance* find(const std::string& path) const;
  const Link* link_from(const std::string& port) const;

 private:
  Instance& instance(const std::string& path);
  void check_is_new(const std::string& path) const;
  void check_memory(const std::string& path) const;
  void disconnect_memory(const std::string& from);
  std::vector<Link>::iterator link_at(const std::string& port);

  unsigned gpcs_;
  std::vector<Instance> instances_;
  std::vector<std::string> absent_;  ///< slots
  std::vector<Link> links_;
  std::vector<ForeignInstance> foreign_memories_;
  std::vector<MemoryLink> memory_links_;
  std::vector<std::string> stubs_;
};

/// Path and port of PATH.PORT. Throws UserError.
std::pair<std::string, std::string> split_port(const std::string& port);
/// A path without its GPC: tc of gpc0.tc; with `_N` of a port taken off as well.
std::string without_gpc(const std::string& path);
/// Whether a name means a path: the path itself, or that of all GPCs alike.
bool names_path(const std::string& name, const std::string& path);

}  // namespace vrpipe
