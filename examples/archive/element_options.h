// SPDX-License-Identifier: LGPL-2.1-or-later
// The element's properties as options of a program.
#pragma once

#include <gst/gst.h>

#include <map>
#include <string>
#include <vector>

namespace qdmd::archive {

struct ElementOption {
  std::string name, help, preset;
};

// Those that say what the pictures are.
std::vector<ElementOption> element_options();
// Throws std::invalid_argument where the property has no such value.
void set_option(GstElement* element, const std::string& name, const std::string& value);
// A qdmdseparate with these values.
GstElement* make_element(const std::map<std::string, std::string>& values);

}  // namespace qdmd::archive
