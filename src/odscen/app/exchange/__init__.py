"""OpenSCENARIO files and what they name: in a folder of the disk, or sent to the server."""
