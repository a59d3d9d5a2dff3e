// SPDX-License-Identifier: LGPL-2.1-or-later
// Reads a video or pictures ("folder/%04d.png") and writes its background and the last mask.
//
//   g++ -std=c++17 subtract.cpp $(pkg-config --cflags --libs qdmd opencv4)
//   ./a.out street.avi background.png mask.png
#include <qdmd/opencv.h>
#include <exception>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

int main(int count, char** arguments) {
  if (count != 4) {
    std::cerr << "usage: subtract VIDEO BACKGROUND MASK\n";
    return 2;
  }
  try {
    cv::VideoCapture video(arguments[1]);
    if (!video.isOpened()) {
      std::cerr << "no video in " << arguments[1] << ": name a file, or pictures as in %04d.png\n";
      return 1;
    }
    // In place of cv::createBackgroundSubtractorMOG2().
    const auto subtractor = qdmd::library::create_background_subtractor();
    cv::Mat frame, mask, background;
    int frames = 0;
    for (; video.read(frame); ++frames) subtractor->apply(frame, mask);
    if (frames == 0) {
      std::cerr << arguments[1] << " has no frame that can be read\n";
      return 1;
    }
    subtractor->getBackgroundImage(background);
    if (!cv::imwrite(arguments[2], background) || !cv::imwrite(arguments[3], mask)) {
      std::cerr << "cannot write " << arguments[2] << " or " << arguments[3] << '\n';
      return 1;
    }
    std::cout << frames << " frames\n";
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
