namespace gapscope::plugins {
void RegisterMotor() {}
}  // namespace gapscope::plugins
