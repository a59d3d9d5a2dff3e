// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdareas.h"

#include <gst/video/gstvideometa.h>

#include <algorithm>
#include <iterator>

namespace qdmd {

GParamSpec* areas_spec(const char* name, const char* nick, const char* blurb, GParamFlags flags) {
  const auto element_flags = GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS);
  GParamSpec* number = g_param_spec_int("number", "Number", "x, y, width or height in pixels",
                                        G_MININT, G_MAXINT, 0, element_flags);
  GParamSpec* rectangle = gst_param_spec_array("rectangle", "Rectangle", "<x, y, width, height>",
                                               number, element_flags);
  return gst_param_spec_array(name, nick, blurb, rectangle, flags);
}

guint add_areas_of(const GValue* value, IgnoredAreas* areas) {
  guint left_out = 0;
  for (guint i = 0; i < gst_value_array_get_size(value); ++i) {
    const GValue* rectangle = gst_value_array_get_value(value, i);
    int numbers[4] = {};
    bool whole = GST_VALUE_HOLDS_ARRAY(rectangle) &&
                 gst_value_array_get_size(rectangle) == std::size(numbers);
    for (guint k = 0; whole && k < std::size(numbers); ++k) {
      const GValue* number = gst_value_array_get_value(rectangle, k);
      whole = G_VALUE_HOLDS_INT(number);
      if (whole) numbers[k] = g_value_get_int(number);
    }
    whole = whole && areas->add({numbers[0], numbers[1], numbers[2], numbers[3]});
    left_out += !whole;
  }
  return left_out;
}

void areas_to(const IgnoredAreas& areas, GValue* value) {
  for (size_t i = 0; i < areas.size(); ++i) {
    GValue rectangle = G_VALUE_INIT;
    g_value_init(&rectangle, GST_TYPE_ARRAY);
    for (int number : {areas[i].x, areas[i].y, areas[i].width, areas[i].height}) {
      GValue element = G_VALUE_INIT;
      g_value_init(&element, G_TYPE_INT);
      g_value_set_int(&element, number);
      gst_value_array_append_and_take_value(&rectangle, &element);
    }
    gst_value_array_append_and_take_value(value, &rectangle);
  }
}

void add_regions_of(GstBuffer* buffer, GQuark type, IgnoredAreas* areas) {
  if (type == 0) return;
  const auto pixels = [](guint length) { return int(std::min(length, guint(G_MAXINT))); };
  gpointer state = nullptr;
  while (auto* meta = gst_buffer_iterate_meta_filtered(
             buffer, &state, GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE)) {
    const auto* region = reinterpret_cast<const GstVideoRegionOfInterestMeta*>(meta);
    if (region->roi_type == type)
      areas->add({pixels(region->x), pixels(region->y), pixels(region->w), pixels(region->h)});
  }
}

}  // namespace qdmd
