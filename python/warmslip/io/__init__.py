"""Files of a run: the trajectory in HDF5, VTU for ParaView."""
