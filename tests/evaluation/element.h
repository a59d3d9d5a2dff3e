// SPDX-License-Identifier: LGPL-2.1-or-later
// The plugin's element: its methods by name, its properties from the command line.
#pragma once

#include <gst/gst.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace qdmd::evaluation {

struct Unref {
  void operator()(void* object) const { gst_object_unref(object); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

// name=value pairs of --set.
using Properties = std::vector<std::pair<std::string, std::string>>;

// Makes the element from this plugin file and no other, even where one is installed. Throws
// std::runtime_error where that fails.
void load_plugin(const std::string& file);

// A new qdmdbackground.
Ref<GstElement> make_element();

// The names of the property `method`.
std::vector<std::string> element_methods();

// Splits name=value. Throws std::invalid_argument, with what is wrong, unless the element has a
// property of that name that takes the value. `method` and `output` are not for users: --methods
// decides on the one, the measures on the other.
std::pair<std::string, std::string> parse_property(const std::string& text);

// What a run over `frames` frames sets: the user's properties over window-size = all frames (up to
// the property's limits) and n-threads = `threads`.
struct ElementOptions {
  Properties properties;
  unsigned threads = 1;

  void apply(GstElement* element, const std::string& method, size_t frames) const;
};

}  // namespace qdmd::evaluation
