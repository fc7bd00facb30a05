#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>

#include <gtest/gtest.h>
#if defined(VRPIPE_SANITIZED)
#include <dlfcn.h>
#include <pthread.h>
#include <unwind.h>

#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>

// In the place of AddressSanitizer's, which forgets the frames that an exception leaves only if it knows where the stack
// ends. SystemC tells it that the main stack is empty, so that whoever has their place next would be blamed.
extern "C" __attribute__((no_sanitize("address"))) _Unwind_Reason_Code _Unwind_RaiseException(
    _Unwind_Exception* exception) {
  constexpr std::size_t above = 256 * 1024;
  // Beyond the main stack's end there may be no memory at all.
  static const auto* const end = [] {
    pthread_attr_t attributes;
    void* start = nullptr;
    std::size_t size = 0;
    ::pthread_getattr_np(::pthread_self(), &attributes);
    ::pthread_attr_getstack(&attributes, &start, &size);
    ::pthread_attr_destroy(&attributes);
    return static_cast<const char*>(start) + size;
  }();
  const auto* const here = static_cast<const char*>(__builtin_frame_address(0));
  const auto below_end = static_cast<std::size_t>(end - here);  // a huge number on other stacks that lie above
  ASAN_UNPOISON_MEMORY_REGION(here, std::min(above, below_end));
  static const auto next =
      reinterpret_cast<_Unwind_Reason_Code (*)(_Unwind_Exception*)>(::dlsym(RTLD_NEXT, "_Unwind_RaiseException"));
  return next(exception);
}
#endif

namespace vrpipe::testing {
namespace {

/// Says on stderr within which test the process ended. Processes that tests fork say nothing.
class LastWords : public ::testing::EmptyTestEventListener {
 public:
  LastWords() {
    owner = ::getpid();
#if defined(VRPIPE_SANITIZED)
    __sanitizer_set_death_callback(say);
#else
    static std::array<char, 16384> own_stack;  // where that of a test has overflowed
    stack_t stack{};
    stack.ss_sp = own_stack.data();
    stack.ss_size = own_stack.size();
    ::sigaltstack(&stack, nullptr);
#endif
    for (const int signal : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) {
      struct sigaction former {};
      ::sigaction(signal, nullptr, &former);
      if (former.sa_handler != SIG_DFL) continue;  // a sanitizer's
      struct sigaction action {};
      action.sa_handler = end;
      action.sa_flags = static_cast<int>(SA_ONSTACK | SA_RESETHAND);
      ::sigaction(signal, &action, nullptr);
    }
    std::atexit(say);
  }

 private:
  void OnTestStart(const ::testing::TestInfo& test) override {
    words = std::string("The process ended within ") + test.test_suite_name() + "." + test.name() + "\n";
  }
  void OnTestEnd(const ::testing::TestInfo&) override { words.clear(); }

  static void say() {
    if (words.empty() || ::getpid() != owner) return;
    if (::write(STDERR_FILENO, words.data(), words.size()) < 0) return;  // nobody is left to be told
  }
  static void end(int signal) {
    say();
    ::raise(signal);  // delivered, as by default, when the handler returns
  }

  static inline std::string words;
  static inline pid_t owner = 0;
};

}  // namespace
}  // namespace vrpipe::testing

// SystemC's library has a main of its own, which would win over the one in an archive.
int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  ::testing::UnitTest::GetInstance()->listeners().Append(new vrpipe::testing::LastWords);
  setenv("SYSTEMC_DISABLE_COPYRIGHT_MESSAGE", "1", 1);
  return RUN_ALL_TESTS();
}
