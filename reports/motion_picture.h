#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/control/picture.h"

namespace ricochet {

/// A motion as it looks: the shapes and arrows of a scene (problems/control/picture.h), sampled finely.
struct MotionPicture {
  struct Frame {
    double t = 0;
    std::vector<Shape> shapes;
    std::vector<Arrow> arrows;
  };
  std::vector<Frame> frames;  ///< ascending in t; the instants of impacts are among them

  bool empty() const { return frames.empty(); }
  /// The frame next to t. Not of an empty picture.
  const Frame& at(double t) const;
};

void to_json(nlohmann::json& j, const MotionPicture& picture);
/// @throws InputError for an unknown shape
void from_json(const nlohmann::json& j, MotionPicture& picture);

/// Where a picture lies on paper: pixels to the right and downwards.
struct PictureView {
  double left = 0, top = 0;  ///< [m] at pixel (0, 0)
  double scale = 1;          ///< pixels per metre
  double per_newton = 0;     ///< pixels
  double width = 0, height = 0;
  double largest_force = 0;  ///< [N], of an arrow

  double x(double metres) const { return scale * (metres - left); }
  double y(double metres) const { return scale * (top - metres); }
};

/// Room for every shape of every frame. @param width  [pixels]
PictureView view_of(const MotionPicture& picture, double width);

/// SVG elements of a frame, one per shape, then one per arrow, each with its number as data-shape or data-arrow.
std::string svg_of(const MotionPicture::Frame& frame, const PictureView& view);
/// A ring about the point where a contact acts; empty when the picture has no arrow for it.
std::string impact_ring(const MotionPicture::Frame& frame, const PictureView& view, int contact);

}  // namespace ricochet
