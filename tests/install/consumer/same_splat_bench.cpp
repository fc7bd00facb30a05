// A testbench of the same-splat QRU, with the installed testbench kit: what comes out at each fidelity with time, and
// that neither the other side's pace nor random stalls change it.
#include <cstdio>
#include <stdexcept>
#include <string>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/testkit/bench.h>

#include "same_splat_qru.h"

namespace {

using vrpipe::BinItem;
using vrpipe::Fidelity;
using vrpipe::Quad;
using vrpipe::QuadBeat;
using vrpipe::Warp;

void check(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

Quad quad(std::uint32_t splat, unsigned position, unsigned triangle) {
  Quad made{};
  made.splat = splat;
  made.position = static_cast<std::uint8_t>(position);
  made.coverage = triangle == 0 ? 0b0011 : 0b1100;
  made.triangle = static_cast<std::uint8_t>(triangle);
  return made;
}

/// Quads and pairing of all warps of a bin, in the order in which they are launched.
std::string launched(Fidelity fidelity, const QuadBeat& bin, std::uint64_t stall_seed, vrpipe::Cycle closed_until) {
  vrpipe::Draw draw;
  draw.width = draw.height = 64;
  vrpipe::RenderContext context;
  context.frame = vrpipe::Frame::of(draw);
  vrpipe::testkit::Bench bench(fidelity, "qru", "same-splat", context);
  auto& sink = bench.sink<Warp>("out_warps");
  if (closed_until > 0) sink.close(0, closed_until);
  if (stall_seed != 0) bench.stall_randomly(stall_seed, 64);

  vrpipe::BinStorage storage;  // of the bin, until its warps are formed
  if (fidelity == Fidelity::cycle) {
    auto& source = bench.source<QuadBeat>("in_quads");
    source.add(bin);
    QuadBeat end;
    end.mark = vrpipe::Mark::end_of_frame;
    source.add(end);
  } else {
    // At lt a bin comes in one piece: batch.h.
    auto& source = bench.source<BinItem>("in_quads");
    storage.flush.quads.assign(bin.quads.begin(), bin.quads.begin() + bin.count);
    BinItem item;
    item.storage = &storage;
    item.tile = bin.tile;
    item.quads = bin.count;
    source.add(item);
    BinItem end;
    end.mark = vrpipe::Mark::end_of_frame;
    source.add(end);
  }
  bench.run();
  check(bench.behaviour<SameSplatQru>().pairs.value() == 2, "pairs of the splats 1 and 2");

  std::string text;
  for (const auto& record : sink.records()) {
    check(record.cycle >= closed_until, "the sink was closed");
    for (unsigned i = 0; i < record.item.count; ++i) {
      const Quad& q = record.item.quads[i];
      const bool back = i % 2 == 1 && ((record.item.merge_pairs >> (i / 2)) & 1) != 0;
      text += (back ? "+" : " ") + std::to_string(q.position) + ":" + std::to_string(q.splat) + "." +
              std::to_string(q.triangle);
    }
    text += record.item.mark == vrpipe::Mark::end_of_frame ? " end" : " |";
  }
  return text;
}

}  // namespace

int main() try {
  QuadBeat bin;
  bin.tile = {1, 2};
  // Position 5: both triangles of splat 1, then both of splat 2. Position 9: splats 3 and 4, then 4 again.
  for (const Quad& q :
       {quad(1, 5, 0), quad(1, 5, 1), quad(3, 9, 0), quad(2, 5, 0), quad(4, 9, 0), quad(4, 9, 1), quad(2, 5, 1)}) {
    bin.quads[bin.count++] = q;
  }
  bin.last_of_bin = true;

  // Splat 3 leaves before the pair of splat 4 would; the order of a position is worth more than a pair.
  const std::string expected = " 5:1.0+5:1.1 9:3.0 9:4.0 5:2.0+5:2.1 9:4.1 | end";
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const std::string where = std::string(" at ") + name_of(fidelity);
    check(launched(fidelity, bin, 0, 0) == expected, "unexpected warps" + where + ":" + launched(fidelity, bin, 0, 0));
    check(launched(fidelity, bin, 0, 500) == expected, "a late receiver changes the warps" + where);
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      check(launched(fidelity, bin, seed, 0) == expected,
            "stalls of seed " + std::to_string(seed) + " change the warps" + where);
    }
  }
  std::puts("same-splat: as expected under 100 seeds of stalls at lt and cycle");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "same_splat_bench: %s\n", error.what());
  return 1;
}
