// SPDX-License-Identifier: LGPL-2.1-or-later
// Tells ThreadSanitizer of GLib's locks: they are futexes in a library that it does not see into.
#include <dlfcn.h>
#include <glib.h>

#if defined(__SANITIZE_THREAD__)
extern "C" {
void __tsan_acquire(void* address);
void __tsan_release(void* address);

// The program's symbols come before the library's.
#define REAL(name) \
  static const auto real = reinterpret_cast<decltype(&name)>(dlsym(RTLD_NEXT, #name))

#define SEEN __attribute__((visibility("default")))

#define SEEN_LOCK(name, Type)                 \
  SEEN void name##_lock(Type* mutex) {        \
    REAL(name##_lock);                        \
    real(mutex);                              \
    __tsan_acquire(mutex);                    \
  }                                           \
  SEEN gboolean name##_trylock(Type* mutex) { \
    REAL(name##_trylock);                     \
    const gboolean locked = real(mutex);      \
    if (locked) __tsan_acquire(mutex);        \
    return locked;                            \
  }                                           \
  SEEN void name##_unlock(Type* mutex) {      \
    REAL(name##_unlock);                      \
    __tsan_release(mutex);                    \
    real(mutex);                              \
  }

SEEN_LOCK(g_mutex, GMutex)
// A pad's stream has one, among others: what held it before has ended what it did.
SEEN_LOCK(g_rec_mutex, GRecMutex)

SEEN void g_cond_wait(GCond* cond, GMutex* mutex) {
  REAL(g_cond_wait);
  __tsan_release(mutex);
  real(cond, mutex);
  __tsan_acquire(mutex);
}

SEEN gboolean g_cond_wait_until(GCond* cond, GMutex* mutex, gint64 end) {
  REAL(g_cond_wait_until);
  __tsan_release(mutex);
  const gboolean woken = real(cond, mutex, end);
  __tsan_acquire(mutex);
  return woken;
}
}
#endif
