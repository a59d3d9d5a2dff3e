// SPDX-License-Identifier: LGPL-2.1-or-later
// Why a call was refused.
#pragma once

#include <string>

namespace qdmd {

// The message is a sentence for the user that says what to change.
struct Status {
  enum class Code {
    ok,
    invalid_options,     // a value outside its range
    too_much_memory,     // what is asked for needs more than max_memory
    not_configured,      // push or drain before configure
    frames_are_waiting,  // push while frames are ready: pop them first
    bad_file,            // bytes that are nothing that was saved
    bad_folder           // no file can be made there, or none so large
  };
  Code code = Code::ok;
  std::string message;

  bool ok() const { return code == Code::ok; }
};

}  // namespace qdmd
