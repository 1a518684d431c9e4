"""Sessions of onnxruntime, as every network gets one."""

from collections.abc import Sequence

import onnxruntime

from edge_ident.errors import ModelError
from edge_ident.model.model import PARAMETERS


def open_session(content: bytes, input_shape: Sequence[int]) -> onnxruntime.InferenceSession:
    """A session on one thread; bytes, so that a file cannot refer to others beside it.

    Parameters
    ----------
    content : bytes
        ONNX file.
    input_shape : sequence of int
        Of its only input, behind the first dimension.

    Raises
    ------
    ModelError
        If onnxruntime refuses the network, or it does not take such inputs to four outputs.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(content, options, ["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions have no common base
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise ModelError(
            f"onnxruntime refuses the network: {first_line}", "export the network again"
        ) from error
    inputs, outputs = session.get_inputs(), session.get_outputs()
    signature = [(len(inputs), len(outputs)), *(list(i.shape[1:]) for i in (*inputs, *outputs))]
    if signature != [(1, 1), list(input_shape), [len(PARAMETERS)]]:
        sizes = ", ".join(str(size) for size in input_shape)
        raise ModelError(
            f"the network maps {inputs[0].shape} to {outputs[0].shape}, "
            f"not (n, {sizes}) to (n, {len(PARAMETERS)})",
            "give a network made by edge-ident export",
        )
    return session
