// Units with a fault each; that every rule of a slot is checked, the tests in the tree show.
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include <vrpipe/modules/qru/qru.h>
#include <vrpipe/modules/tc/tc.h>
#include <vrpipe/modules/vpo/vpo.h>
#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {

using Flush = vrpipe::TcBehaviour::Flush;

struct Throws : vrpipe::TileCoalescing {
  using TileCoalescing::TileCoalescing;
  unsigned insert(const vrpipe::QuadBeat&, unsigned, Flush&, bool&) override { throw std::runtime_error("too full"); }
};
struct TakesTooMuch : vrpipe::TileCoalescing {
  using TileCoalescing::TileCoalescing;
  unsigned insert(const vrpipe::QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override {
    return TileCoalescing::insert(beat, from, out, flushed) + 1;
  }
};
struct Crashes : vrpipe::TileCoalescing {
  using TileCoalescing::TileCoalescing;
  bool flush_oldest(FlushReason, Flush&) override { return std::raise(SIGSEGV) == 0; }
};
struct Exits : vrpipe::TileCoalescing {
  using TileCoalescing::TileCoalescing;
  bool flush_oldest(FlushReason, Flush&) override { std::exit(0); }
};
struct Overruns : vrpipe::PairingQru {
  using PairingQru::PairingQru;
  unsigned examine(vrpipe::TileId tile, const vrpipe::Quad* quads, unsigned count, vrpipe::Warp& out,
                   bool& launched) override {
    for (unsigned i = 0; i < 2 * vrpipe::quads_per_warp; ++i) out.quads[i] = quads[i % count];
    return PairingQru::examine(tile, quads, count, out, launched);
  }
};
struct CrashesWhenMade : vrpipe::PrimitiveAssembly {
  CrashesWhenMade(const Parameters& parameters, const vrpipe::RenderContext& context)
      : PrimitiveAssembly(parameters, context) {
    std::raise(SIGFPE);
  }
};

template <class Unit>
using Tc = vrpipe::Registrar<Unit, vrpipe::TcBehaviour>;
const Tc<Throws> throws("tc", "throws", "throws in a call");
const Tc<TakesTooMuch> takes_too_much("tc", "takes-too-much", "takes more quads than there are");
const Tc<Crashes> crashes("tc", "crashes", "ends by a signal");
const Tc<Exits> exits("tc", "exits", "calls exit()");
const vrpipe::Registrar<Overruns, vrpipe::QruBehaviour> overruns("qru", "overruns", "writes past the quads of a warp");
const vrpipe::Registrar<CrashesWhenMade, vrpipe::VpoBehaviour> when_made("vpo", "crashes-when-made",
                                                                         "ends by a signal");

}  // namespace
