// python/gapscope/torch.py, as it is.
#ifndef GAPSCOPE_EXPORT_TORCH_FILE_H_
#define GAPSCOPE_EXPORT_TORCH_FILE_H_

namespace gapscope::assets {

extern const char* const kTorch;

}  // namespace gapscope::assets

#endif  // GAPSCOPE_EXPORT_TORCH_FILE_H_
