#pragma once

#include <map>
#include <memory>
#include <string>

#include <systemc>

#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

/// While it lives, what is constructed is a child of a module, or, of null, of none. IEEE 1666-2023 has sc_hierarchy_scope
/// for that; SystemC 2.3 has the stack behind it.
class ModuleScope {
 public:
  explicit ModuleScope(sc_core::sc_module* module);
  ~ModuleScope();
  ModuleScope(const ModuleScope&) = delete;
  ModuleScope& operator=(const ModuleScope&) = delete;

 private:
  sc_core::sc_simcontext* const pushed_to_;  ///< null for no module
};

/// The SystemC modules in which a netlist's instances lie: gpc0.crop is the child crop of gpc0. An instance has no others as
/// children, since it has ports, whose names it chooses: what is l2.helper where l2 is an instance lies beside it as
/// l2_helper.
class Hierarchy {
 public:
  explicit Hierarchy(const Netlist& netlist);
  ~Hierarchy();

  /// Where an instance is to be constructed, while this lives, and the name that it is to have there.
  struct Place {
    ModuleScope scope;
    std::string name;
  };
  Place place_of(const std::string& path);

 private:
  const Netlist& netlist_;
  std::map<std::string, std::unique_ptr<sc_core::sc_module>> modules_;  ///< by path
};

}  // namespace vrpipe
