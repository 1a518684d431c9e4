"""Offline, in torch: data sets, network, training, ONNX export, quantization, evaluation."""
