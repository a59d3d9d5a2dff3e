// SPDX-License-Identifier: LGPL-2.1-or-later
// Parts that are found by links: each element names another one of its part, and one of them
// itself. It stands for the part.
#pragma once

namespace qdmd {

// The element that stands for the part of `element`. named(i): a reference to what element i names.
template <typename Index, typename Named>
Index part_of(Index element, const Named& named) {
  while (named(element) != element) {
    // Halves the way for the next who asks.
    named(element) = named(named(element));
    element = named(element);
  }
  return element;
}

}  // namespace qdmd
