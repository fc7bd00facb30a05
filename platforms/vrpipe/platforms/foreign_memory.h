#pragma once

#include <memory>
#include <vector>

#include <systemc>
#include <tlm>

namespace vrpipe {

/// A memory of another make, as an instance of a platform: a SystemC module, and sockets of the unmodified TLM-2.0 base
/// protocol: one for each unit that is connected to it, or a single one that takes many.
struct ForeignMemory {
  std::unique_ptr<sc_core::sc_module> module;
  std::vector<tlm::tlm_base_target_socket_b<32>*> sockets;
};

}  // namespace vrpipe
