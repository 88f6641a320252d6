// MAT files of any content: refused with a reason, or arrays whose sizes fit their values. matio and HDF5 read them in
// a process of their own, as a crash there is nothing new; here it counts whether one is contained, and is told at the
// end.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#include <sys/time.h>
#include <zlib.h>

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/array_file.hpp"
#include "host/input/data/mat5_check.hpp"
#include "tests/fuzz/readers.hpp"

namespace {

using namespace flexspline;
using tests::require;

constexpr std::size_t kMat5Header = 128;
constexpr std::uint32_t kMiMatrix = 14, kMiCompressed = 15;

// The reader's own process ends by itself, and leaves no input of the fuzzer's behind. HDF5 may run for ever, which its
// limit of processor time ends after five seconds: too long for a fuzzer on a busy machine.
void be_a_plain_child() {
  const itimerval limit{{0, 0}, {0, 250'000}};
  setitimer(ITIMER_PROF, &limit, nullptr);
  __sanitizer_set_death_callback(nullptr);
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE, SIGTERM, SIGINT, SIGXFSZ, SIGPROF})
    std::signal(signal, SIG_DFL);
}

struct Counts {
  std::uint64_t read = 0, refused = 0, contained = 0;
  ~Counts() {
    std::fprintf(stderr,
                 "mat_files: %llu files were read, %llu refused; of %llu the reader's process did not end well\n",
                 static_cast<unsigned long long>(read), static_cast<unsigned long long>(refused),
                 static_cast<unsigned long long>(contained));
  }
};

std::string packed(std::string_view element) {
  uLongf size = compressBound(element.size());
  std::string out(size + 8, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(out.data() + 8), &size,
                               reinterpret_cast<const Bytef*>(element.data()), element.size(), 1);
  require(status == Z_OK, "zlib does not pack");
  const std::uint32_t tag[2] = {kMiCompressed, static_cast<std::uint32_t>(size)};
  std::memcpy(out.data(), tag, sizeof tag);
  out.resize(size + 8);
  return out;
}

// Each element of a version 5 file packed as MATLAB does, so that the checksums of what is packed are no wall.
std::string with_packed_elements(std::string_view file) {
  std::string out(file.substr(0, kMat5Header));
  for (std::size_t at = kMat5Header; at + 8 <= file.size();) {
    std::uint32_t tag[2];
    std::memcpy(tag, file.data() + at, sizeof tag);
    const std::size_t left = file.size() - at, wanted = std::size_t{8} + tag[1];
    const std::string_view element = file.substr(at, tag[0] == kMiMatrix && wanted < left ? wanted : left);
    out += packed(element);
    at += element.size();
  }
  return out;
}

}  // namespace

// The sanitizer takes the place of the reader's own limit of memory, which it cannot live with; a short quarantine
// keeps the process small, which is what it costs to start another.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=64:allocator_may_return_null=1:quarantine_size_mb=8";
}

// The first byte: the file as it is, or with its elements packed.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size < 1) return 0;
  static const tests::ScratchFolder folder;
  static Counts counts;
  static const int once = pthread_atfork(nullptr, nullptr, be_a_plain_child);
  require(once == 0, "no handler at fork");
  std::string file(reinterpret_cast<const char*>(bytes) + 1, size - 1);
  if ((bytes[0] & 1) != 0 && file.size() > kMat5Header) file = with_packed_elements(file);
  // In this process, where libFuzzer sees what it does; the other repeats it.
  const std::string damage = data::damage_of_mat5(file);
  const std::filesystem::path path = folder.write("data.mat", file);
  // Most inputs are damaged, and a process costs as much as a hundred of them.
  if (data::mat_version(path) == data::MatVersion::v5 && !damage.empty()) return 0;
  data::Findings findings;
  try {
    const data::ArrayFile mat(path, data::format_of(path), findings);
    for (std::size_t k = 0; k < mat.names().size(); ++k) {
      const std::size_t wanted[] = {k};
      require(mat.read(wanted).rows() == mat.length(k), "a column is of another length");
    }
    ++counts.read;
  } catch (const data::DataError& error) {
    require(!error.findings().empty(), "it refuses without a reason");
    const bool ended = error.findings().back().what.find("cannot be read") == std::string::npos;
    ++(ended ? counts.refused : counts.contained);
  }
  return 0;
}
