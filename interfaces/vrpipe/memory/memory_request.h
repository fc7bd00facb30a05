#pragma once

#include <array>
#include <cstdint>

#include <tlm>

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// What an access to memory is for.
enum class MemoryTraffic : std::uint8_t { other, color, depth_stencil, vertex, attribute };
constexpr unsigned memory_traffics = 5;
const char* name_of(MemoryTraffic traffic);

/// Who asks, and for what.
struct MemoryOrigin {
  MemoryTraffic traffic = MemoryTraffic::other;
  std::uint16_t gpc = 0;  ///< that the unit belongs to; 0 for the front end
  /// Of a buffer that is written round and round: which round the contents are of. A cache that does not see all writes
  /// tells them apart by it, as who keeps it coherent would.
  std::uint16_t round = 0;
};

/// An access to memory. Data stays with the functional models, so it carries none.
struct MemoryRequest {
  std::uint64_t address = 0;
  std::uint32_t bytes = 0;  ///< a power of two that divides the address
  tlm::tlm_command command = tlm::TLM_READ_COMMAND;
  MemoryOrigin origin;
  /// Without time: it is made in every order of accesses, unlike what a cache misses because of what came between.
  bool is_certain = true;
};

constexpr bool is_write(const MemoryRequest& request) { return request.command == tlm::TLM_WRITE_COMMAND; }

/// Whether some quad may have to wait for it. Vertices are read, and attributes written, also of what makes no quad any
/// more; so a frame may end before that is done.
constexpr bool is_for_quads(const MemoryRequest& request) {
  return request.origin.traffic != MemoryTraffic::vertex &&
         (request.origin.traffic != MemoryTraffic::attribute || !is_write(request));
}

/// What a payload of the base protocol has no place for. Ignorable: a memory that does not know it serves the access.
struct MemoryRequestExtension : tlm::tlm_extension<MemoryRequestExtension> {
  MemoryOrigin origin;
  /// The access is so many cycles of its unit's clock earlier than its annotated time, which cannot lie in the past. A
  /// memory that does not know of it answers so much later than it might, and the port takes that off.
  Cycle late_cycles = 0;

  tlm::tlm_extension_base* clone() const override { return new MemoryRequestExtension(*this); }
  void copy_from(const tlm::tlm_extension_base& from) override {
    *this = static_cast<const MemoryRequestExtension&>(from);
  }
};

/// Bytes that passed between two levels of memory.
struct MemoryBytes {
  std::uint64_t read = 0;
  std::uint64_t written = 0;

  void count(const MemoryRequest& request) { (is_write(request) ? written : read) += request.bytes; }
  MemoryBytes& operator+=(const MemoryBytes& other) {
    read += other.read;
    written += other.written;
    return *this;
  }
};

/// The request that a payload carries; of an unknown origin if its initiator is of another make.
MemoryRequest request_of(const tlm::tlm_generic_payload& payload);

/// Accesses by origin, as declared counters: "color_reads", "color_bytes_read", … of each traffic.
class MemoryTrafficCounters {
 public:
  explicit MemoryTrafficCounters(StatisticSet& owner);

  void count(const MemoryRequest& request) {
    Moved& moved = moved_[static_cast<unsigned>(request.origin.traffic)][is_write(request)];
    ++moved.accesses;
    moved.bytes += request.bytes;
  }
  /// Of all traffic.
  MemoryBytes bytes() const;
  std::uint64_t accesses(MemoryTraffic traffic, bool written) const { return of(traffic, written).accesses.value(); }
  std::uint64_t bytes(MemoryTraffic traffic, bool written) const { return of(traffic, written).bytes.value(); }

 private:
  struct Moved {
    Counter accesses, bytes;
  };
  using OfTraffic = std::array<Moved, 2>;    ///< read, written
  using Names = std::array<const char*, 4>;  ///< reads, bytes read, writes, bytes written
  static OfTraffic made(StatisticSet& owner, const Names& names, const char* meaning);
  const Moved& of(MemoryTraffic traffic, bool written) const { return moved_[static_cast<unsigned>(traffic)][written]; }

  std::array<OfTraffic, memory_traffics> moved_;
};

}  // namespace vrpipe
