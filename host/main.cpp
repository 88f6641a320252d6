#include <cstdlib>  // defines __GLIBC__ where it is glibc

#include "host/app/cli/app.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // Matrices of some megabytes come and go by the thousand. Memory that is returned to the system each time must be
  // cleared again each time.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
  return flexspline::cli::run(argc, argv);
}
