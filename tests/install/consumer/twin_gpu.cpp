// A platform of one's own: two GPCs, the second with twice the colour cache and a deeper queue in front of its colour ROP,
// and a memory of another make below the L2; drawn in every variant.
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <tlm_utils/multi_passthrough_target_socket.h>
#include <systemc>
#include <tlm>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/scene.h>

namespace {

/// A memory that knows nothing of vrpipe: 200 ns for any access, in a time of its own, and a refresh that never stops.
class Dram : public sc_core::sc_module {
 public:
  explicit Dram(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_b_transport(this, &Dram::access);
    socket.register_nb_transport_fw(this, &Dram::request);
    SC_HAS_PROCESS(Dram);
    SC_METHOD(refresh);
  }
  tlm_utils::multi_passthrough_target_socket<Dram> socket;

 private:
  void access(int, tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) {
    delay += sc_core::sc_time(200, sc_core::SC_NS);
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum request(int from, tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                             sc_core::sc_time& delay) {
    if (phase == tlm::BEGIN_REQ) access(from, payload, delay);
    return tlm::TLM_COMPLETED;
  }
  void refresh() { next_trigger(3900, sc_core::SC_NS); }
};

vrpipe::Platform twin() {
  vrpipe::Platform platform;
  platform.name = "twin";
  platform.description =
      "two GPCs of agx-orin-ideal-memory with different colour caches, and a memory of another make below the L2";
  platform.gpcs = 2;
  platform.frequency_mhz = 612;
  platform.settings = {{"gpc1.crop", "cache_bytes", "32768"}, {"link.gpc1.prop.color", "depth", "256"}};
  platform.wire = [](vrpipe::Netlist& netlist) {
    vrpipe::wire_pipeline(netlist);
    netlist.add_memory("dram", [](const std::string& name, unsigned) {
      auto dram = std::make_unique<Dram>(name.c_str());
      tlm::tlm_base_target_socket_b<32>* const socket = &dram->socket;
      return vrpipe::ForeignMemory{std::move(dram), {socket}};
    });
    netlist.connect_memory("l2", "dram");
  };
  return platform;
}

}  // namespace

int main() try {
  vrpipe::add_platform(twin());

  vrpipe::SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = vrpipe::ImageSize{160, 120};
  const vrpipe::Draw draw = vrpipe::load_scene(scene).draw;

  for (const char* platform : {"agx-orin-ideal-memory", "twin"}) {
    for (const vrpipe::Fidelity fidelity : {vrpipe::Fidelity::lt, vrpipe::Fidelity::cycle}) {
      for (const vrpipe::Variant& variant : vrpipe::variants()) {
        vrpipe::RunRequest request;
        request.platform = &vrpipe::platform_named(platform);
        request.variant = variant;
        request.fidelity = fidelity;
        vrpipe::fresh_simulation();
        const vrpipe::RunResult result = vrpipe::simulate(request, draw);
        std::printf("%s %s %s %llu cycles\n", platform, name_of(fidelity), variant.name.c_str(),
                    static_cast<unsigned long long>(result.cycles.value()));
      }
    }
  }
  return 0;
} catch (const vrpipe::UserError& error) {
  std::fprintf(stderr, "twin_gpu: error: %s\n", error.what());
  return 2;
}
