#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

void wire_gpc(Netlist& netlist, unsigned gpc, const std::string& memory) {
  const std::string index = std::to_string(gpc);
  const std::string self = "gpc" + index + ".";
  for (const char* slot : {"vpo", "tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"}) netlist.add(self + slot);
  const auto connect = [&](const std::string& from, const std::string& to, unsigned depth = 4) {
    netlist.connect(from, to, depth);
  };

  // Vertices: issued, shaded on the SM array, assembled.
  connect("draw.out_vertices_" + index, self + "sm.in_vertices");
  connect(self + "sm.out_vertices", self + "vpo.in_vertices");

  // Primitives to the GPCs that own their tiles, to quads, quads to bins.
  if (netlist.gpcs() == 1) {
    connect(self + "vpo.out_primitives", self + "tgc.in_primitives", 16);
  } else {
    connect(self + "vpo.out_primitives", "wdx.in_primitives_" + index, 16);
    connect("wdx.out_primitives_" + index, self + "tgc.in_primitives", 16);
  }
  connect(self + "tgc.out_jobs", self + "raster.in_jobs", 16);
  connect(self + "raster.out_quads", self + "tc.in_quads", 8);
  connect(self + "tc.out_bins", self + "prop.in_bins", 8);

  // The early tests, and back.
  connect(self + "prop.out_test", self + "zrop.in_quads", 8);
  connect(self + "zrop.out_quads", self + "prop.in_tested", 8);

  // Warps to the SMs, shaded quads in order to CROP.
  connect(self + "prop.out_survivors", self + "qru.in_quads", 8);
  connect(self + "qru.out_warps", self + "sm.in_warps", 8);
  connect(self + "sm.out_shaded", self + "prop.in_shaded", 64);
  connect(self + "prop.out_release", self + "sm.in_release", 8);
  connect(self + "prop.out_color", self + "crop.in_color", 8);

  // Tests after shading, and back.
  connect(self + "prop.out_late", self + "zrop.in_late", 8);
  connect(self + "zrop.out_late", self + "prop.in_late", 8);

  // Early termination: from the alpha test back to the stencil.
  connect(self + "crop.out_terminations", self + "zrop.in_terminations", 16);

  // Hi-Z: from what depth tests store back to coarse rasterisation.
  connect(self + "zrop.out_hi_z", self + "raster.in_hi_z", 16);

  // A barrier: what was drawn has been blended.
  connect(self + "crop.out_done", "draw.in_done_" + index);

  netlist.connect_memory(self + "crop", memory);
}

void wire_pipeline(Netlist& netlist) {
  netlist.add("draw");
  if (netlist.gpcs() > 1) {
    netlist.add("wdx");
  } else {
    netlist.do_without("wdx");
  }
  netlist.add("l2");
  for (unsigned gpc = 0; gpc < netlist.gpcs(); ++gpc) wire_gpc(netlist, gpc);
}

void wire_dram(Netlist& netlist, const std::string& dram) {
  netlist.replace("l2", "sectored-cache");
  netlist.add("dram", "dram", dram);
  netlist.connect_memory("l2", "dram");
}

namespace {
std::vector<std::string> units_of(const Netlist& netlist, const std::string& slot) {
  std::vector<std::string> units;
  for (const Instance& instance : netlist.instances()) {
    if (instance.slot == slot) units.push_back(instance.path);
  }
  return units;
}
void connect_all(Netlist& netlist, const std::string& slot, const std::string& memory) {
  for (const std::string& unit : units_of(netlist, slot)) netlist.connect_memory(unit, memory);
}
}  // namespace

void connect_attribute_traffic(Netlist& netlist, const std::string& memory) { connect_all(netlist, "sm", memory); }

void insert_l1(Netlist& netlist, const std::string& implementation) {
  for (const std::string& sm : units_of(netlist, "sm")) {
    const std::string l1 = sm.substr(0, sm.rfind('.') + 1) + "l1";
    netlist.add(l1, "l1", implementation);
    netlist.insert_memory(sm, l1);
  }
}

void connect_depth_stencil_traffic(Netlist& netlist, const std::string& memory) {
  connect_all(netlist, "zrop", memory);
}

}  // namespace vrpipe
