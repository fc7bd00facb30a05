#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace vrpipe {

/// Runs work(chunk) for chunk 0 .. chunks-1 on up to `threads` threads, whichever is free; on fewer when the system gives
/// no more. What `work` throws first is thrown here, once all threads have ended; chunks not begun by then are left out.
template <class Work>
void for_each_chunk(std::uint64_t chunks, unsigned threads, const Work& work) {
  std::atomic<std::uint64_t> next{0};
  std::exception_ptr failure;
  std::once_flag failed;
  const auto run = [&] {
    try {
      for (std::uint64_t chunk = next++; chunk < chunks; chunk = next++) work(chunk);
    } catch (...) {
      next = chunks;
      std::call_once(failed, [&] { failure = std::current_exception(); });
    }
  };
  std::vector<std::thread> others;
  try {
    for (unsigned i = 1; i < threads && i < chunks; ++i) others.emplace_back(run);
  } catch (const std::exception&) {
    // No more threads to be had: those that run do the work.
  }
  run();
  for (std::thread& thread : others) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace vrpipe
